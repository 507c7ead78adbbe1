"""One case of the profile: a controller in a closed loop with an ideal robot, timed."""

from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from handrail.collect.experiments.profiling.scene import random_intent, random_scene, robot_for
from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.command import Status
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.ocp.problem import Plan, Problem
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.robot.shape import Obstacle

PERIOD = 0.05  # of the updates [s]
_INTENT = 20  # updates of one intent
_EPISODE = 100  # updates in one scene


@dataclass(frozen=True)
class Case:
    """What one loop measures.

    Attributes:
        name: unique.
        robot: its description.
        own: which of the robot's own pairs are watched: `all`, `few` or `none`.
        obstacles: how many.
        horizon: stages.
    """

    name: str
    own: str = "all"
    obstacles: int = 0
    horizon: int = 10
    robot: str = "ridgeback_ur10"


CASES = (
    Case("no_collision", own="none"),
    Case("pairs_30", own="few", obstacles=2),
    Case("pairs_100", obstacles=7),
)


def longer(*horizons: int) -> list[Case]:
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

    def __init__(self, case: Case, seed: int) -> None:
        self.case = case
        self.model = robot_for(case.robot, case.own)
        self.mpc = MaskedMpc(self.model, MpcSettings(horizon=case.horizon))
        self._rng = np.random.default_rng(seed)
        self._count = 0

    def run(self, count: int) -> list[Update]:
        """Return some updates, timed one by one."""
        return [self._update() for _ in range(count)]

    def _begin(self) -> None:
        """Put the robot at home in a new scene."""
        self._obstacles = random_scene(self.model, self.case.obstacles, self._rng)
        self.mpc.reset(self._obstacles)
        self._state = State(self.model.description.home, np.zeros(self.model.size))

    def _update(self) -> Update:
        if self._count % _EPISODE == 0:
            self._begin()
        state = self._state
        if self._count % _INTENT == 0:
            self._intent = random_intent(self.model, state, self._obstacles, self._rng)
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


def times(seconds: list[float]) -> dict[str, float]:
    """Return median, p95, p99 and worst [ms]."""
    milliseconds = 1e3 * np.array(seconds)
    names = ("median_ms", "p95_ms", "p99_ms", "worst_ms")
    return dict(zip(names, np.percentile(milliseconds, (50, 95, 99, 100)).tolist(), strict=True))
