"""The backup: what the robot does where no new plan may be sent."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.trajectory import Trajectory
from handrail.controllers.ocp.problem import Plan
from handrail.controllers.safety.certificate import StopCertificate, Violation
from handrail.controllers.safety.limiter import Limiter

_SAMPLES = 2  # of a plan's stage
_SAME = 1e-6  # difference of velocities that is rounding [m/s, rad/s]


@dataclass(frozen=True)
class Situation:
    """Where the robot is, and how the motion that was stored has gone on.

    Attributes:
        q: measured position, (n,).
        v: velocity that a command begins with: the commanded one, if the robot keeps up, (n,).
        distances: signed distances of all pairs, (P,) [m].
        elapsed: time since the last update [s].
    """

    q: FloatArray
    v: FloatArray
    distances: FloatArray
    elapsed: float


@dataclass(frozen=True)
class Candidate:
    """Something that the robot may do now.

    Attributes:
        motion: what is done for sure, unless a later update finds something better; then a full stop.
        violation: of its safety.
        planned: whether it begins with the new plan.
    """

    motion: Trajectory
    violation: Violation
    planned: bool = False


class Backup:
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

    Args:
        certificate: measures the ways.
        limiter: knows the full stop.
        dt: time between knots [s].
    """

    def __init__(self, certificate: StopCertificate, limiter: Limiter, dt: float) -> None:
        self._certificate = certificate
        self._limiter = limiter
        self._dt = dt
        self._stored: Trajectory | None = None

    def measure_by(self, certificate: StopCertificate) -> None:
        """Measure by other pairs from now on: something was grasped or let go."""
        self._certificate = certificate

    def choose(self, situation: Situation, plan: Plan | None, halt: bool = False) -> Candidate:
        """Return the way to take, and store it.

        Args:
            situation: of the robot.
            plan: of this update; None when there is none.
            halt: whether a full stop is wanted, rather than what is stored.
        """
        refused: list[Candidate] = []
        for way in self._ways(situation, plan, halt):
            if way.violation.all <= 0.0:
                break
            refused.insert(0, way)
        else:
            way = min(refused, key=lambda refused: refused.violation)  # of equals the one farther down
        self._stored = way.motion
        return way

    def brake(self, velocity: FloatArray) -> Trajectory:
        """Return a full stop from a velocity, (n,), which is stored unmeasured: nobody knows where we are."""
        self._stored = self._braking(velocity)
        return self._stored

    def _ways(self, situation: Situation, plan: Plan | None, halt: bool) -> Iterator[Candidate]:
        now = situation.q, situation.distances
        if plan is not None:
            violation = self._certificate.violation(plan.q[1], plan.v[1], now, self._dt)
            yield Candidate(Trajectory(plan.v[:2], self._dt), violation, planned=True)
            yield from self._farther(plan, now)
        if halt:
            yield self._stop(situation)
        if self._stored is not None:
            rest = self._stopping(self._stored).after(situation.elapsed)
            if np.allclose(situation.v, rest.velocity(0.0), rtol=0.0, atol=_SAME):
                yield Candidate(rest, self._certificate.until_rest(*rest.path(situation.q), now))
        if not halt:
            yield self._stop(situation)

    def _farther(self, plan: Plan, now: tuple[FloatArray, FloatArray]) -> Iterator[Candidate]:
        """Yield the plan as far as its own path is safe, then a full stop; half as far; and so on."""
        path = Trajectory(plan.v, self._dt).path(plan.q[0], _SAMPLES)
        violations = self._certificate.along(*path, now)[:, 1]
        unsafe = np.flatnonzero(violations > 0.0)
        stages = len(plan.u) if not len(unsafe) else (int(unsafe[0]) - 1) // _SAMPLES
        while stages > 1:
            violation = self._certificate.violation(plan.q[stages], plan.v[stages], now, self._dt * stages)
            yield Candidate(Trajectory(plan.v[: stages + 1], self._dt), violation, planned=True)
            stages //= 2

    def _stop(self, situation: Situation) -> Candidate:
        now = situation.q, situation.distances
        violation = self._certificate.violation(situation.q, situation.v, now)
        return Candidate(self._braking(situation.v), violation)

    def _braking(self, velocity: FloatArray) -> Trajectory:
        """Return a full stop from a velocity, (n,)."""
        return Trajectory(self._limiter.to_rest(velocity[None], self._dt), self._dt)

    def _stopping(self, motion: Trajectory) -> Trajectory:
        """Return a motion and a full stop from its end."""
        return replace(motion, velocities=self._limiter.to_rest(motion.velocities, self._dt))
