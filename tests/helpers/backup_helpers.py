"""An ideal robot among obstacles, watched between updates too, for the tests of the backup."""

from dataclasses import replace

import numpy as np

from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.model import load_model
from handrail.controllers.robot.shape import Obstacle, Shape

MODEL = load_model()
HOME = MODEL.description.home
LIMITS = MODEL.description.limits
PERIOD = 0.05
TRAIL = 5  # positions looked at in a period


class Robot:
    """Follows commands exactly; remembers commands and the smallest true distance to anything.

    It says what it was sent last, whatever a test makes of its velocity.
    """

    def __init__(self, controller, obstacles=(), period=PERIOD, q=HOME):
        controller.reset(obstacles)
        self.controller, self.period = controller, period
        self.q, self.v, self.time = np.array(q), np.zeros(MODEL.size), 0.0
        self.sent = self.v
        self.smallest, self.commands, self.steps = np.inf, [], []
        self._obstacles = obstacles
        self._truth = CollisionModel(MODEL, obstacles)

    @property
    def state(self):
        return State(self.q, self.v, self.time, self.sent)

    def observe(self):
        self.controller.update_scene(self._seen(self.time))

    def update(self, intent, state=None):
        """Let the controller see a state, the true one if None; move for one period."""
        self.observe()
        command = self.controller.update(self.state if state is None else state, intent)
        self.steps.append(command.velocity(0.0) - self.sent)
        for k in range(TRAIL):
            before, after = (command.velocity(share * self.period / TRAIL) for share in (k, k + 1))
            self.q = self.q + 0.5 * self.period / TRAIL * (before + after)
            self.time += self.period / TRAIL
            self._look()
        self.steps.append(after - self.sent)
        self.v = self.sent = after
        self.commands.append(command)
        return command

    def put(self, *obstacles):
        """Put the obstacles somewhere else."""
        self._obstacles = obstacles

    def _look(self):
        still = tuple(replace(o, velocity=np.zeros(3)) for o in self._seen(self.time))
        self._truth = self._truth.among(still)
        self.smallest = min(self.smallest, self._truth.values(self.q[None])[0].min())

    def _seen(self, time):
        return tuple(replace(o, position=o.position + time * o.velocity) for o in self._obstacles)


def asking(channels, values, *groups):
    """Return what makes the intent of a time."""
    mask = channels.mask(*groups)
    return lambda time: Intent(np.where(mask, values, 0.0), mask, time=time)


def table(height):
    """Return a table in the way of the hand, its top `height` above the tool [m]."""
    x, y, z = MODEL.pose(HOME).position
    return Obstacle("table", Shape("box", [0.6, 1.2, 0.05]), [x + 0.7, y, z + height - 0.025])


def clutter(rng, count=6, speed=0.0):
    """Return posts and balls around the robot; those that move cross its way."""
    things = []
    for index in range(count):
        angle, away = rng.uniform(-np.pi, np.pi), rng.uniform(1.1, 2.0) + 2.0 * speed
        place = HOME[:2] + away * np.array([np.cos(angle), np.sin(angle)])
        way = HOME[:2] + rng.uniform(-1.0, 1.0, 2) - place
        velocity = np.append(speed * way / np.linalg.norm(way), 0.0)
        if rng.random() < 0.5:
            height = rng.uniform(0.2, 1.5)
            shape, z = Shape("cylinder", [rng.uniform(0.05, 0.2), height]), height / 2
        else:
            shape, z = Shape("sphere", [rng.uniform(0.08, 0.2)]), rng.uniform(0.3, 1.2)
        things.append(Obstacle(f"thing_{index}", shape, [*place, z], velocity=velocity))
    return tuple(things)
