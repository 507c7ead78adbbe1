"""One case of the profile: a controller in a closed loop with an ideal robot, timed."""

from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Status
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.ocp.problem import Plan, Problem
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.robot.description import load_description
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.shape import Obstacle, Shape
from handrail.scripts.bench.goal_reaching.scenes import clearance

PERIOD = 0.05  # of the updates [s]
_INTENT = 20  # updates of one intent
_EPISODE = 100  # updates in one scene
_NEAREST, _FARTHEST = 0.12, 0.30  # between robot and obstacle at home [m]
_SPEED = 0.4  # [m/s, rad/s]
_MODES = (("ee",), ("base",), ("base", "ee"), ("joint",))


@dataclass(frozen=True)
class SpeedCase:
    """What one loop measures."""

    name: str  # unique
    own: str = "all"  # which of the robot's own pairs are watched: `all`, `few` or `none`
    obstacles: int = 0  # how many
    horizon: int = 10  # stages
    robot: str = "ridgeback_ur10"  # its description


CASES = (
    SpeedCase("no_collision", own="none"),
    SpeedCase("pairs_30", own="few", obstacles=2),
    SpeedCase("pairs_100", obstacles=7),
)


def longer(*horizons: int) -> list[SpeedCase]:
    """Return the cases with other numbers of stages."""
    return [
        replace(case, name=f"{case.name}_horizon_{horizon}", horizon=horizon)
        for case in CASES
        for horizon in horizons
    ]


@dataclass(frozen=True)
class Update:
    """One timed update: what went in, what came out, and how long it took [s]."""

    seconds: float
    obstacles: tuple[Obstacle, ...]
    state: State
    intent: Intent
    problem: Problem
    guess: FloatArray
    plan: Plan | None
    status: Status


class TimingLoop:
    """A closed loop of one case: warm-started updates, intents that change, scenes that change.

    Args:
        case: what to measure.
        seed: of scenes and intents; cases with the same robot and seed get the same ones.
    """

    def __init__(self, case: SpeedCase, seed: int) -> None:
        self.case = case
        self.model = _robot(case.robot, case.own)
        self.mpc = MaskedMpc(self.model, MpcSettings(horizon=case.horizon))
        self._rng = np.random.default_rng(seed)
        self._count = 0

    def run(self, count: int) -> list[Update]:
        """Return some updates, timed one by one."""
        return [self._update() for _ in range(count)]

    def _begin(self) -> None:
        """Put the robot at home in a new scene."""
        self._obstacles = _random_scene(self.model, self.case.obstacles, self._rng)
        self.mpc.reset(self._obstacles)
        self._state = State(self.model.description.home, np.zeros(self.model.size))

    def _update(self) -> Update:
        if self._count % _EPISODE == 0:
            self._begin()
        state = self._state
        if self._count % _INTENT == 0:
            self._intent = _random_intent(self.model, state, self._obstacles, self._rng)
        intent = replace(self._intent, time=state.time)
        problem = self.mpc.build_problem(state, intent)
        guess = self.mpc.loop.guess(state.time, self.case.horizon, self.model.size)
        start = perf_counter()
        command = self.mpc.update(state, intent)
        seconds = perf_counter() - start
        after = command.velocity(PERIOD)
        self._state = State(state.q + 0.5 * PERIOD * (state.v + after), after, state.time + PERIOD)
        self._count += 1
        asked = self._obstacles, state, intent, problem, guess
        return Update(seconds, *asked, self.mpc.plan, command.diagnostics.status)


def _robot(robot: str, pairs: str) -> RobotModel:
    """Return a robot with `all` its own pairs, `few` or `none` at all (it then meets no obstacle either)."""
    description = load_description(robot)
    if pairs == "none":
        hand, none = replace(description.end_effector, gripper=None), np.zeros(0)
        description = replace(description, end_effector=hand, collision=(), self_pairs=(), self_margins=none)
    elif pairs == "few":
        few = slice(None, None, 4)
        description = replace(
            description, self_pairs=description.self_pairs[few], self_margins=description.self_margins[few]
        )
    return RobotModel(description)


def _random_scene(model: RobotModel, count: int, rng: np.random.Generator) -> tuple[Obstacle, ...]:
    """Return obstacles of all kinds, each 0.12 to 0.3 m from the robot at home."""
    home = model.description.home
    obstacles: list[Obstacle] = []
    while len(obstacles) < count:
        obstacle = _random_obstacle(f"obstacle_{len(obstacles)}", home, rng)
        if _NEAREST < clearance(model, obstacle) < _FARTHEST:
            obstacles.append(obstacle)
    return tuple(obstacles)


def _random_obstacle(name: str, home: FloatArray, rng: np.random.Generator) -> Obstacle:
    shape = (
        Shape("box", rng.uniform(0.1, 0.5, 3)),
        Shape("cylinder", rng.uniform([0.05, 0.2], [0.2, 0.8])),
        Shape("capsule", rng.uniform([0.04, 0.2], [0.15, 0.6])),
        Shape("sphere", rng.uniform(0.05, 0.2, 1)),
    )[rng.integers(4)]
    position = np.append(home[:2], 0.0) + rng.uniform([-1.2, -1.2, 0.1], [1.6, 1.2, 1.4])
    return Obstacle(name, shape, position, turned(np.eye(3), rng.uniform(-np.pi, np.pi)))


def _random_intent(
    model: RobotModel, state: State, obstacles: tuple[Obstacle, ...], rng: np.random.Generator
) -> Intent:
    """Return an intent in one mode or another: random, and towards an obstacle where there is one."""
    channels = Channels.of(model.description)
    mask = channels.mask(*(group for group in _MODES[rng.integers(len(_MODES))] if group != "base"))
    mask[channels.base_slice] = bool(channels.base) and rng.random() < 0.5
    values = rng.uniform(-_SPEED, _SPEED, channels.size)
    if obstacles:
        target = obstacles[rng.integers(len(obstacles))].position
        values[channels.tool_slice][:3] = _SPEED * _unit(target - model.pose(state.q).position)
        if channels.base:
            values[:2] = _SPEED * turned(_unit(target[:2] - state.q[:2]), -state.q[2])
    return Intent(np.where(mask, values, 0.0), mask, time=state.time)


def _unit(vector: FloatArray) -> FloatArray:
    return vector / max(float(np.linalg.norm(vector)), 1e-9)
