"""One case of the profile: a controller in a closed loop with an ideal robot, timed."""

from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from handrail.collect.experiments.profiling.scene import Driver, random_scene, robot_for
from handrail.controllers.arrays import FloatArray, IntArray
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
    """What one lane measures.

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


@dataclass(frozen=True)
class Update:
    """One timed update: what went in, what came out, and how long it took [s]."""

    seconds: float
    state: State
    intent: Intent
    problem: Problem
    guess: FloatArray
    plan: Plan
    status: str


class _Watched:
    """Passes problems on to the solver and keeps the last one."""

    def __init__(self, solver: object) -> None:
        self._solver = solver

    def solve(self, problem: Problem, guess: FloatArray, active: IntArray) -> Plan:
        """Solve, and remember."""
        plan = self._solver.solve(problem, guess, active)  # type: ignore[attr-defined]
        self.last = problem, guess, plan
        return plan

    def __getattr__(self, name: str) -> object:
        """Be the solver in everything else."""
        return getattr(self._solver, name)


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
        self._watched = _Watched(self.mpc.solver)
        self.mpc.solver = self._watched  # type: ignore[assignment]
        self._rng = np.random.default_rng(seed)
        self._driver = Driver(self.model, self._rng)
        self._count = 0
        self.obstacles: tuple[Obstacle, ...] = ()

    @property
    def at_new_scene(self) -> bool:
        """Whether the next update begins a scene."""
        return self._count % _EPISODE == 0

    def begin(self) -> None:
        """Put the robot at home in a new scene."""
        self.obstacles = random_scene(self.model, self.case.obstacles, self._rng)
        self.mpc.reset(self.obstacles)
        self._state = State(self.model.description.home, np.zeros(self.model.size))

    def run(self, count: int) -> list[Update]:
        """Return some updates, timed one by one."""
        return [self._update() for _ in range(count)]

    def _update(self) -> Update:
        state = self._state
        if self._count % _INTENT == 0:
            self._intent = self._driver.choose(state, self.obstacles)
        intent = replace(self._intent, time=state.time)
        start = perf_counter()
        command = self.mpc.update(state, intent)
        seconds = perf_counter() - start
        after = command.velocity(PERIOD)
        self._state = State(state.q + 0.5 * PERIOD * (state.v + after), after, state.time + PERIOD)
        self._count += 1
        return Update(seconds, state, intent, *self._watched.last, command.diagnostics.status.value)


def times(seconds: list[float]) -> dict[str, float]:
    """Return median, p95, p99 and worst [ms]."""
    milliseconds = 1e3 * np.array(seconds)
    names = ("median_ms", "p95_ms", "p99_ms", "worst_ms")
    return dict(zip(names, np.percentile(milliseconds, (50, 95, 99, 100)).tolist(), strict=True))
