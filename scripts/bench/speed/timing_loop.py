"""One case of the bench: a controller in a closed loop with an ideal robot, timed."""

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from time import perf_counter, thread_time

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Status
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.mpc.loop_state import LoopState
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.ocp.problem import Plan, Problem
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.robot.description import RobotDescription, load_description
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.scene_shapes import floor_shapes, scene_shapes
from handrail.controllers.robot.shape import Obstacle, Shape, ShapeKind
from handrail.scripts.bench.goal_reaching.scenes import clearance
from handrail.scripts.bench.report import spread

PERIOD = 0.05  # of the updates [s]
_INTENT = 20  # updates of one intent
_EPISODE = 100  # updates in one scene
_NEAREST, _FARTHEST = 0.12, 0.30  # between robot and obstacle at home [m]
_SPEED = 0.4  # [m/s, rad/s]
_MODES = (("ee",), ("base",), ("base", "ee"), ("joint",))
_ROBOTS = {  # by degrees of freedom: the description, and words in the names of joints that are left out
    8: ("lekiwi", ()),
    9: ("ridgeback_ur10", ()),
    10: ("ridgeback_panda", ()),
    13: ("tiago_pro", ("left_",)),
    18: ("tiago_pro", ("head_",)),
    20: ("tiago_pro", ()),
}


@dataclass
class Times:
    """How long calls took: processor time of this thread, which others lengthen less; on the clock."""

    cpu: list[float] = field(default_factory=list)  # [s]
    wall: list[float] = field(default_factory=list)  # [s]

    def of[Result](self, call: Callable[..., Result], *arguments: object) -> Result:
        """Call, take the time, and return what the call returned."""
        wall, cpu = perf_counter(), thread_time()
        result = call(*arguments)
        self.cpu.append(thread_time() - cpu)
        self.wall.append(perf_counter() - wall)
        return result

    def spreads(self, first: int = 0) -> dict[str, dict[str, float]]:
        """Return median, p95, p99 and worst of both clocks [ms], from some call on."""
        return {"cpu": spread(self.cpu[first:]), "wall": spread(self.wall[first:])}


@dataclass(frozen=True)
class SpeedCase:
    """The measurements of one loop."""

    degrees: int = 9  # of freedom
    pairs: int = 0  # to keep apart, about
    horizon: int = 10  # stages

    @property
    def name(self) -> str:
        """A unique name."""
        return f"n={self.degrees} pairs={self.pairs} N={self.horizon}"


@dataclass(frozen=True)
class Update:
    """One timed update: what went in, what came out, and how long it took."""

    cpu: float  # [s]
    before: LoopState
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

    Attributes:
        times: of all updates.
    """

    def __init__(self, case: SpeedCase, seed: int) -> None:
        self.case = case
        self.model, self._obstacle_count = _robot(case)
        self._scale = self.model.description.world.scale
        self.mpc = MaskedMpc(self.model, MpcSettings.of(self._scale, horizon=case.horizon))
        self.times = Times()
        self._rng = np.random.default_rng(seed)

    def run(self, count: int) -> list[Update]:
        """Return some updates, timed one by one."""
        return [self._update() for _ in range(count)]

    def _update(self) -> Update:
        count = len(self.times.cpu)
        if count % _EPISODE == 0:
            self._obstacles = self._random_scene()
            self.mpc.reset(self._obstacles)
            self._state = State(self.model.description.home, np.zeros(self.model.size))
        state = self._state
        if count % _INTENT == 0:
            self._intent = self._random_intent(state)
        intent = replace(self._intent, time=state.time)
        problem = self.mpc.build_problem(state, intent)
        before = self.mpc.loop
        guess = before.guess(state.time, self.case.horizon, self.model.size)
        command = self.times.of(self.mpc.update, state, intent)
        after = command.velocity(PERIOD)
        self._state = State(state.q + 0.5 * PERIOD * (state.v + after), after, state.time + PERIOD)
        asked = before, self._obstacles, state, intent, problem, guess
        return Update(self.times.cpu[-1], *asked, self.mpc.plan, command.diagnostics.status)

    def _random_scene(self) -> tuple[Obstacle, ...]:
        """Return obstacles of all kinds, each 0.12 to 0.3 m · scale from the robot at home."""
        obstacles: list[Obstacle] = []
        while len(obstacles) < self._obstacle_count:
            obstacle = self._random_obstacle(f"obstacle_{len(obstacles)}")
            if _NEAREST < clearance(self.model, obstacle) / self._scale < _FARTHEST:
                obstacles.append(obstacle)
        return tuple(obstacles)

    def _random_obstacle(self, name: str) -> Obstacle:
        rng, home = self._rng, self.model.description.home
        shapes: tuple[tuple[ShapeKind, FloatArray], ...] = (
            ("box", rng.uniform(0.1, 0.5, 3)),
            ("cylinder", rng.uniform([0.05, 0.2], [0.2, 0.8])),
            ("capsule", rng.uniform([0.04, 0.2], [0.15, 0.6])),
            ("sphere", rng.uniform(0.05, 0.2, 1)),
        )
        kind, size = shapes[rng.integers(4)]
        place = self._scale * rng.uniform([-1.2, -1.2, 0.1], [1.6, 1.2, 1.4])
        position = np.append(home[:2], 0.0) + place
        shape = Shape(kind, self._scale * size)
        return Obstacle(name, shape, position, turned(np.eye(3), rng.uniform(-np.pi, np.pi)))

    def _random_intent(self, state: State) -> Intent:
        """Return an intent in one mode or another: random, and towards an obstacle where there is one."""
        rng, speed, channels = self._rng, _SPEED * self._scale, Channels.of(self.model.description)
        mask = channels.mask(*(group for group in _MODES[rng.integers(len(_MODES))] if group != "base"))
        mask[channels.base_slice] = bool(channels.base) and rng.random() < 0.5
        values = rng.uniform(-speed, speed, channels.size)
        if self._obstacles:
            target = self._obstacles[rng.integers(len(self._obstacles))].position
            values[channels.hand_slice()][:3] = speed * _unit(target - self.model.pose(state.q).position)
            if channels.base:
                values[:2] = speed * turned(_unit(target[:2] - state.q[:2]), -state.q[2])
        return Intent(np.where(mask, values, 0.0), mask, time=state.time)


def _unit(vector: FloatArray) -> FloatArray:
    return vector / max(float(np.linalg.norm(vector)), 1e-9)


def _robot(case: SpeedCase) -> tuple[RobotModel, int]:
    """Return a case's robot and how many obstacles there are: half of the pairs are with them, or more.

    The robot watches as many of its own pairs, evenly chosen, as the other half wants. Without pairs it has
    no shapes.
    """
    file, words = _ROBOTS[case.degrees]
    description = _without(load_description(file), words)
    if not case.pairs:
        hands, none = tuple(replace(hand, gripper=None) for hand in description.hands), np.zeros(0)
        bare = replace(description, hands=hands, collision=(), self_pairs=(), self_margins=none)
        return RobotModel(bare), 0
    model = RobotModel(description)
    each, floor, own = len(scene_shapes(model)), len(floor_shapes(model)), len(description.self_pairs)
    few = int(np.clip(case.pairs - floor - each * round(case.pairs / 2 / each), 0, own))
    chosen = np.linspace(0, own - 1, few).round().astype(int)
    pairs, margins = tuple(description.self_pairs[k] for k in chosen), description.self_margins[chosen]
    fewer = replace(description, self_pairs=pairs, self_margins=margins)
    return RobotModel(fewer), max(round((case.pairs - floor - few) / each), 0)


def _without(description: RobotDescription, words: tuple[str, ...]) -> RobotDescription:
    """Return a robot without the joints that have one of these words in their names, nor such shapes."""

    def stays(name: str) -> bool:
        return not any(word in name for word in words)

    joints = np.array([stays(name) for name in description.joints])
    pairs = np.array([all(map(stays, pair)) for pair in description.self_pairs])
    limits, hands = description.limits, [hand for hand in description.hands if stays(hand.frame)]
    return replace(
        description,
        hands=tuple(hands) if len(hands) > 1 else (replace(hands[0], name=""),),
        cameras=(),
        arms=tuple(replace(arm, joints=tuple(filter(stays, arm.joints))) for arm in description.arms),
        home=description.home[joints],
        limits=replace(limits, **{each.name: getattr(limits, each.name)[joints] for each in fields(limits)}),
        collision=tuple(shape for shape in description.collision if stays(shape.name)),
        self_pairs=tuple(pair for pair in description.self_pairs if all(map(stays, pair))),
        self_margins=description.self_margins[pairs],
    )
