"""Random cluttered scenes and random, rude intents, for the safety fuzz."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

import handrail.collect  # noqa: F401  (registers the environments)
from handrail.collect.env import HandrailEnv
from handrail.collect.scene import Scene, SceneObject, View
from handrail.collect.tasks.reach import Reach
from handrail.collect.tasks.task import Episode
from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision import CollisionModel
from handrail.controllers.command import Status
from handrail.controllers.errors import HandrailError
from handrail.controllers.frames import Frames
from handrail.controllers.intent import Intent
from handrail.controllers.mpc import MaskedMpc
from handrail.controllers.problem import Plan, Problem
from handrail.controllers.shape import Shape

GROUPS = [
    ("ee",),
    ("base",),
    ("joint",),
    ("base", "ee"),
    ("ee.vx", "ee.vy", "ee.vz"),
    ("elbow",),
    (),
]
_ELBOW = 5  # index of a joint in the middle of the arm
CLEARANCE = 0.15  # of the robot at the start [m]


@dataclass(frozen=True)
class FuzzResult:
    """What a run showed."""

    contacts: int
    contact_names: tuple[str, ...]
    smallest: float
    statuses: dict[str, int]
    excess: float  # of velocity or acceleration over the limit, relative


def cluttered_episode(env: HandrailEnv, rng: np.random.Generator) -> Episode:
    """Draw a start posture and things around the robot, none nearer than the clearance."""
    model = env.model
    sampled = Reach().sample(model, rng)
    while True:
        q = np.array(model.description.home)
        q[:3] = rng.uniform([-1.5, -1.5, -3.0], [1.5, 1.5, 3.0])
        q[3:] += rng.uniform(-0.7, 0.7, model.size - 3)
        q = np.clip(q, model.description.limits.position_lower, model.description.limits.position_upper)
        own = CollisionModel(model)
        if np.all(own.values(q[None])[0] > np.minimum(own.largest_margin, 0.10)):
            break
    objects: list[SceneObject] = []
    wanted = int(rng.integers(4, 11))
    for _ in range(400):
        if len(objects) == wanted:
            break
        item = _thing(f"thing_{len(objects)}", q, rng)
        scene = Scene((*objects, item), View((-3, -3, 3), (0, 0, 0.5), 50.0))
        if np.all(CollisionModel(model, scene.obstacles()).values(q[None])[0] > _least(model, scene)):
            objects.append(item)
    return Episode(Scene(tuple(objects), sampled.scene.view), q, sampled.goal)


def _least(model, scene):
    collision = CollisionModel(model, scene.obstacles())
    return np.minimum(collision.largest_margin, CLEARANCE)


def _thing(name, q, rng):
    angle, distance = rng.uniform(-np.pi, np.pi), rng.uniform(0.5, 2.2)
    x, y = q[0] + distance * np.cos(angle), q[1] + distance * np.sin(angle)
    height = rng.uniform(0.2, 1.6)
    raised = rng.uniform(0.0, 1.0) if rng.random() < 0.3 else 0.0  # a shelf or a lamp in the air
    if rng.random() < 0.5:
        shape = Shape("cylinder", [rng.uniform(0.05, 0.25), height])
    else:
        shape = Shape("box", [*rng.uniform(0.1, 0.6, 2), height])
    return SceneObject(name, shape, np.array([x, y, raised + height / 2]), rgba=(0.5, 0.5, 0.5, 1.0))


class RudeOperator:
    """Full-speed, jerky, switching intents; now and then garbage, huge, stale or in no known frame."""

    def __init__(self, channels, limits, rng):
        self._channels, self._limits, self._rng = channels, limits, rng
        self._until = 0.0

    def _group(self, index):
        elbow = self._channels.joints[_ELBOW]
        return [elbow if name == "elbow" else name for name in GROUPS[index]]

    def intent(self, time):
        rng, size = self._rng, self._channels.size
        if time >= self._until:
            self._until = time + rng.uniform(0.05, 2.0)
            self._mask = (
                self._channels.mask(*self._group(rng.integers(len(GROUPS))))
                if rng.random() < 0.8
                else (rng.random(size) < 0.4)
            )
            full = np.concatenate([[1, 1, 0.4], [1, 1, 1, 2, 2, 2], self._limits.velocity])
            self._values = full * rng.choice([-1.0, 1.0, 0.0, 0.5], size)
            self._frames = Frames(
                rng.choice(["base", "world"]), rng.choice(["world", "tool"]), rng.uniform(-0.3, 0.3, 3)
            )
        values, mask, frames, stamp = self._values, self._mask, self._frames, time
        trouble = rng.random()
        if trouble < 0.02:
            values = np.where(rng.random(size) < 0.3, rng.choice([np.nan, np.inf, -np.inf]), values)
        elif trouble < 0.04:
            values = values * 1e6
        elif trouble < 0.05:
            stamp = time - rng.uniform(0.3, 5.0)
        elif trouble < 0.06:
            frames = Frames("moon", "world")
        elif trouble < 0.07:
            values, mask = np.zeros(3), np.zeros(3, dtype=bool)
        elif trouble < 0.20:
            values = values + rng.normal(0, 0.5, size)
        return Intent(values, mask, time=stamp, frames=frames)


@contextmanager
def failing(controller: MaskedMpc, seed: int, share: float) -> Iterator[None]:
    """Let the solver fail at random, now and then for a while."""
    rng, honest, until = np.random.default_rng([seed, 2]), controller.solver.solve, 0

    def solve(problem: Problem, guess: FloatArray) -> Plan:
        nonlocal until
        if until > 0 or rng.random() < share:
            until = until - 1 if until else int(rng.integers(0, 20))
            raise HandrailError("the solver fails on purpose")
        return honest(problem, guess)

    controller.solver.solve = solve
    yield
    controller.solver.solve = honest


def run(env: HandrailEnv, controller: MaskedMpc, seed: int, seconds: float) -> FuzzResult:
    rng = np.random.default_rng(seed)
    episode = cluttered_episode(env, rng)
    env.reset(seed=seed, options={"episode": episode})
    controller.reset(env.obstacles())
    limits = env.model.description.limits
    rude = RudeOperator(controller.channels, limits, rng)
    contacts, names, smallest, excess = 0, set(), np.inf, 0.0
    statuses: dict[str, int] = {}
    exact = CollisionModel(env.model, env.obstacles())
    previous, period = np.zeros(env.model.size), 1.0 / env.fps
    for _ in range(int(seconds * env.fps)):
        state = env.state()
        command = controller.update(state, rude.intent(state.time))
        velocity = command.velocity(period)
        excess = max(
            excess,
            float(np.max(np.abs(velocity) / limits.velocity - 1.0)),
            float(np.max(np.abs(velocity - previous) / (limits.acceleration * period) - 1.0)),
        )
        previous = velocity
        statuses[command.health.status.value] = statuses.get(command.health.status.value, 0) + 1
        _, _, _, _, info = env.step(np.append(velocity, 0.0).astype(np.float32))
        contacts += info["contacts"]
        names |= set(info["contact_names"])
        smallest = min(smallest, float(exact.values(env.state().q[None])[0].min()))
    assert command.health.status in Status
    return FuzzResult(contacts, tuple(sorted(names)), smallest, statuses, excess)
