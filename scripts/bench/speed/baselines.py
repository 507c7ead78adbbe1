"""What the controller is measured against: the converged solver on its problems, and mink."""

from collections.abc import Callable
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from handrail.collect.world.mink import MinkController
from handrail.controllers.interface.channels import Channels
from handrail.controllers.robot.shape import Obstacle
from handrail.controllers.solvers.converged import ConvergedSolver
from handrail.scripts.bench.report import spread
from handrail.scripts.bench.speed.timing_loop import PERIOD, TimingLoop, Update

Solve = Callable[[Update], float | None]
"""Time that the problem of an update takes [s]; None where it is not solved."""


class Rival:
    """One other solver on the problems of a loop.

    Args:
        name: of the solver.
        loop: whose problems.
        solve: what is timed.
        every: solve only one of so many.
    """

    def __init__(self, name: str, loop: TimingLoop, solve: Solve, every: int = 1) -> None:
        self.loop = loop
        self._name, self._solve, self._every = name, solve, every
        self._count = self._failed = 0
        self._seconds: list[float] = []  # of what was solved
        self._ours: list[float] = []  # of the controller on the same problems

    def run(self, updates: list[Update]) -> None:
        """Time some of these updates' problems."""
        for update in updates:
            self._count += 1
            if self._count % self._every:
                continue
            seconds = self._solve(update)
            if seconds is None:
                self._failed += 1
            else:
                self._seconds.append(seconds)
                self._ours.append(update.seconds)

    def measured(self) -> dict[str, Any]:
        """Return its times, and our median over its own; None where it solved nothing."""
        counts = {"name": self._name, "solves": len(self._seconds), "failed": self._failed}
        if not self._seconds:
            return {**counts, "ratio": None}
        ratio = float(np.median(self._ours) / np.median(self._seconds))
        return {**counts, **spread(self._seconds), "ratio": ratio}


def converged(loop: TimingLoop) -> Solve:
    """Return IPOPT, converged, begun from the same guess."""
    settings = loop.mpc.settings
    solver = ConvergedSolver(loop.mpc.residuals, settings.horizon, loop.model.size, settings.dt)
    built = False

    def solve(update: Update) -> float | None:
        nonlocal built
        if not built:
            solver.solve(update.problem, update.guess)
            built = True
        start = perf_counter()
        plan = solver.solve(update.problem, update.guess)
        return perf_counter() - start if plan.solved else None

    return solve


def mink(loop: TimingLoop, activation_distance: float) -> Solve:
    """Return one step of mink for the hand's part of an intent: same shapes, pairs, margins and limits.

    Args:
        loop: whose robot, scenes and states.
        activation_distance: beyond the margin, at which a pair enters mink's problem [m].
    """
    controller = MinkController(loop.model, PERIOD, activation_distance)
    hand = Channels.of(loop.model.description).mask("ee")
    among: list[tuple[Obstacle, ...]] = []

    def solve(update: Update) -> float | None:
        if among != [update.obstacles]:
            among[:] = [update.obstacles]
            controller.reset(update.obstacles)
        command = controller.update(update.state, replace(update.intent, mask=hand))
        diagnostics = command.diagnostics
        return None if diagnostics.status.brakes else diagnostics.solve_time

    return solve
