"""An ideal robot among obstacles, watched between updates too; what it is asked for and where it goes."""

from dataclasses import replace

import numpy as np

from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.frames import Frames
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.description import RobotDescription
from handrail.controllers.robot.model import RobotModel, load_model
from handrail.controllers.robot.shape import Obstacle, Shape

MODEL = load_model()
HOME = MODEL.description.home
LIMITS = MODEL.description.limits
CHANNELS = Channels.of(MODEL.description)
REST = np.zeros(MODEL.size)
PERIOD = 0.05
TRAIL = 5  # positions looked at in a period


def without_shapes(description: RobotDescription) -> RobotModel:
    """Return a robot that can meet nothing, without a gripper."""
    hands = tuple(replace(hand, gripper=None) for hand in description.hands)
    nothing = {"collision": (), "self_pairs": (), "self_margins": np.zeros(0)}
    return RobotModel(replace(description, hands=hands, **nothing))


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


def intent(values, *groups, time=0.0, frames=None):
    """Return an intent: values of the channels, (18,) or by name, of which those of some groups are owned."""
    if isinstance(values, dict):
        values = np.array([values.get(name, 0.0) for name in CHANNELS.names])
    mask = CHANNELS.mask(*groups)
    return Intent(np.where(mask, values, 0.0), mask, time=time, frames=frames or Frames())


def asking(values, *groups, frames=None):
    """Return what makes the intent of a time."""
    return lambda time: intent(values, *groups, time=time, frames=frames)


def roll(controller, intents, q=HOME, period=PERIOD):
    """Run a controller on a robot that does as it is told; return positions, velocities and commands."""
    positions, velocities, commands = [np.array(q)], [np.zeros(len(q))], []
    for step, ask in enumerate(intents):
        time = step * period
        command = controller.update(State(positions[-1], velocities[-1], time), ask(time))
        velocity = command.velocity(period)
        positions.append(positions[-1] + 0.5 * period * (velocities[-1] + velocity))
        velocities.append(velocity)
        commands.append(command)
    return np.array(positions), np.array(velocities), commands


def realised(q, v):
    """Return the velocity along every channel, (18,): of the base in its frame, of the tool in the world."""
    c, s = np.cos(q[2]), np.sin(q[2])
    return np.concatenate([[c * v[0] + s * v[1], -s * v[0] + c * v[1], v[2]], MODEL.jacobian(q) @ v, v])


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
