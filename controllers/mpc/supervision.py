"""Turns a plan into a command: the plan where it is safe, else what `Backup` has instead."""

import math
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.surroundings import Surroundings
from handrail.controllers.interface.command import Command, Diagnostics, Status
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent, closed
from handrail.controllers.interface.trajectory import Trajectory
from handrail.controllers.mpc.loop_state import LoopState
from handrail.controllers.ocp.problem import Plan
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.safety.backup import Backup, Candidate, Situation, full_stop
from handrail.controllers.safety.certificate import Certificate, Violation
from handrail.controllers.safety.limiter import Limiter

_UNHEARD = (Status.INVALID_STATE, Status.INVALID_SCENE, Status.INVALID_INTENT, Status.STALE_INTENT)


@dataclass(frozen=True)
class Supervisor:
    """Says what is sent."""

    limiter: Limiter  # knows the limits and the full stop
    settings: MpcSettings  # margins, horizon
    hands: int = 1  # of the robot

    def supervise(
        self, loop: LoopState, state: State, intent: Intent, plan: Plan | None, status: Status, start: float
    ) -> tuple[Command, LoopState]:
        """Return the command of an update, which ends at rest, and the loop's state after it.

        Args:
            loop: the state before it.
            state: of the robot.
            intent: of the operator.
            plan: what came of the update's problem, if anything.
            status: why there is none; or `ok`.
            start: when the update began [s].
        """
        distances = self._distances(loop, state, plan)
        if distances is not None and len(loop.surroundings.collision.held):
            loop = loop._replace(surroundings=loop.surroundings.seen(distances))
        way = self._way(loop, state, plan, distances, halt=status in _UNHEARD)
        motion, planned = way.motion, way.planned > 0.0
        if plan is not None and not (planned and way.violation.all <= 0.0):
            status = Status.BACKUP
        diagnostics = _diagnostics(plan, status, start, distances, loop.surroundings)
        grippers = _grippers(loop, intent, status, self.hands)
        planned_path = Trajectory(plan.v, self.settings.dt) if plan is not None and planned else None
        command = Command(motion.velocities, motion.dt, motion.elapsed, grippers, diagnostics, planned_path)
        return command, loop.following(
            command, state.time, self.settings.dt, plan if planned else None, way.planned
        )

    def _way(
        self, loop: LoopState, state: State, plan: Plan | None, distances: FloatArray | None, halt: bool
    ) -> Candidate:
        """Return how the robot moves, to rest at last.

        Only what was certified is sent, whole: if the next update is late, nothing moves the robot that
        nobody has checked.
        """
        if distances is None:
            followed = loop.command.velocity(loop.elapsed(state.time)) if loop.command else None
            stop = full_stop(self.limiter, state.sent(self.limiter.limits, followed), self.settings.dt)
            return Candidate(stop, Violation(np.inf, np.inf, 0.0))
        sent, elapsed = state.sent(self.limiter.limits), loop.elapsed(state.time)
        situation = Situation(state.expected, sent, distances, loop.command, elapsed)
        lag = None if state.expected is state.q else state.q - state.expected
        settings = self.settings
        least, span = settings.margin_share * loop.surroundings.margins, settings.horizon * settings.dt
        certificate = Certificate(loop.surroundings.collision, least, span, lag)
        return Backup(certificate, self.limiter, settings.dt).choose(situation, plan, halt)

    def _distances(self, loop: LoopState, state: State, plan: Plan | None) -> FloatArray | None:
        """Return the signed distances now, (P,); None where nobody knows where the robot is."""
        if plan is not None:
            return plan.distances
        known = state.is_of(len(self.limiter.limits.velocity))
        return loop.surroundings.collision.values(state.expected[None, :])[0] if known else None


def _grippers(loop: LoopState, intent: Intent, status: Status, hands: int) -> tuple[float, ...]:
    """Return how far grippers are closed: as asked; as before where nobody is listened to."""
    if status in _UNHEARD:
        return (math.nan,) * hands if loop.command is None else loop.command.grippers
    return closed(intent.grippers, hands)


def _diagnostics(
    plan: Plan | None, status: Status, start: float, distances: FloatArray | None, surroundings: Surroundings
) -> Diagnostics:
    slack = 0.0 if plan is None else max(plan.collision_slack, plan.limit_slack)
    near = (np.inf, np.inf) if distances is None else surroundings.smallest(distances)
    return Diagnostics(status, perf_counter() - start, slack, *near)
