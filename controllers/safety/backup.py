"""The backup: what the robot does where no new plan may be sent."""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.trajectory import Trajectory
from handrail.controllers.ocp.problem import Plan
from handrail.controllers.safety.certificate import StopCertificate, Violation
from handrail.controllers.safety.limiter import Limiter

_SAMPLES = 2  # of a plan's stage
_SAME = 1e-6  # difference of velocities that is rounding [m/s, rad/s]


class Situation(NamedTuple):
    """Where the robot is, and what was stored."""

    q: FloatArray  # measured position, (n,)
    v: FloatArray  # velocity that a command begins with, (n,)
    distances: FloatArray  # signed distances of all pairs, (P,) [m]
    stored: Trajectory | None
    """The motion of the candidate taken last, from when that was on; None before the first."""
    elapsed: float  # time since then [s]


class Candidate(NamedTuple):
    """Something that the robot may do now."""

    motion: Trajectory
    """What is done for sure, unless a later update finds something better; then a full stop."""
    violation: Violation  # of its safety
    planned: bool = False  # whether it begins with the new plan


class Backup(NamedTuple):
    """A ladder of ways, of which the robot takes the first that is safe.

    1. The new plan, if a full stop after its first stage is safe; that stage and stop are stored.
    2. The new plan, if its own path and a full stop from its end are safe, or from half way, or half of that;
       these are stored.
    3. What is stored, from where it is now; only if its velocity is that: not when it was held back, nor when
       an update comes so late that more than was stored has been driven.
    4. A full stop at once.

    An operator who is gone or talks nonsense has no plan, and wants 4 before 3. Where no way is safe,
    because an obstacle or the robot was moved by somebody else, it is the one that falls least short: first
    of keeping from itself and from what stands still, then of keeping from everything.
    """

    certificate: StopCertificate  # measures the ways
    limiter: Limiter  # knows the full stop
    dt: float  # time between knots [s]

    def choose(self, situation: Situation, plan: Plan | None, halt: bool = False) -> Candidate:
        """Return the way to take, whose motion is to be stored.

        Args:
            situation: of the robot.
            plan: of this update; None when there is none.
            halt: whether a full stop is wanted, rather than what is stored.
        """
        refused: list[Candidate] = []
        for way in self._ways(situation, plan, halt):
            if way.violation.all <= 0.0:
                return way
            refused.insert(0, way)
        return min(refused, key=lambda refused: refused.violation)  # of equals the one farther down

    def _ways(self, situation: Situation, plan: Plan | None, halt: bool) -> Iterator[Candidate]:
        now = situation.q, situation.distances
        if plan is not None:
            violation = self.certificate.violation(plan.q[1], plan.v[1], now, self.dt)
            yield Candidate(Trajectory(plan.v[:2], self.dt), violation, planned=True)
            yield from self._farther(plan, now)
        if halt:
            yield self._stop(situation)
        if situation.stored is not None:
            rest = self._stopping(situation.stored).after(situation.elapsed)
            if np.allclose(situation.v, rest.velocity(0.0), rtol=0.0, atol=_SAME):
                yield Candidate(rest, self.certificate.until_rest(*rest.path(situation.q), now))
        if not halt:
            yield self._stop(situation)

    def _farther(self, plan: Plan, now: tuple[FloatArray, FloatArray]) -> Iterator[Candidate]:
        """Yield the plan as far as its own path is safe, then a full stop; half as far; and so on."""
        path = Trajectory(plan.v, self.dt).path(plan.q[0], _SAMPLES)
        violations = self.certificate.along(*path, now)[:, 1]
        unsafe = np.flatnonzero(violations > 0.0)
        stages = len(plan.u) if not len(unsafe) else (int(unsafe[0]) - 1) // _SAMPLES
        while stages > 1:
            violation = self.certificate.violation(plan.q[stages], plan.v[stages], now, self.dt * stages)
            yield Candidate(Trajectory(plan.v[: stages + 1], self.dt), violation, planned=True)
            stages //= 2

    def _stop(self, situation: Situation) -> Candidate:
        now = situation.q, situation.distances
        violation = self.certificate.violation(situation.q, situation.v, now)
        return Candidate(full_stop(self.limiter, situation.v, self.dt), violation)

    def _stopping(self, motion: Trajectory) -> Trajectory:
        """Return a motion and a full stop from its end."""
        return replace(motion, velocities=self.limiter.to_rest(motion.velocities, self.dt))


def full_stop(limiter: Limiter, velocity: FloatArray, dt: float) -> Trajectory:
    """Return the fastest stop from a velocity, (n,), with knots every dt [s]."""
    return Trajectory(limiter.to_rest(velocity[None], dt), dt)
