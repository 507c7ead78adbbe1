"""The backup: what the robot does where no new plan may be sent."""

from collections.abc import Iterator
from math import ceil
from typing import NamedTuple

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.trajectory import Trajectory
from handrail.controllers.ocp.problem import Plan
from handrail.controllers.safety.certificate import Certificate, Violation
from handrail.controllers.safety.limiter import Limiter

_SAME = 0.01  # time by which the clock of a robot may be off [s]


class Situation(NamedTuple):
    """Where the robot is, and what it follows."""

    q: FloatArray  # measured position, (n,)
    v: FloatArray  # velocity that a command begins with, (n,)
    distances: FloatArray  # signed distances of all pairs, (P,) [m]
    followed: Trajectory | None  # the last command; None before the first
    elapsed: float  # time since then [s]


class Candidate(NamedTuple):
    """Something that the robot may do now."""

    motion: Trajectory  # to rest
    violation: Violation  # of its safety
    planned: float = 0.0  # how long it follows the new plan [s]


class Backup(NamedTuple):
    """A ladder of ways, of which the robot takes the first that is safe.

    1. The new plan's first stage and a full stop from its end.
    2. The whole new plan and a full stop from its end; or as far as that is safe, half as far, and so on.
    3. The plan that it follows already; only if its velocity is that plan's now, or within 10 ms: a clock may
       be off by that. Not when it was held back.
    4. A full stop at once.

    An operator who is gone or talks nonsense has no plan, and wants 4 before 3. Where no way is safe,
    because an obstacle or the robot was moved by somebody else, it is the one that falls least short: first
    of keeping from itself and from what stands still, then of keeping from everything.
    """

    certificate: Certificate  # measures the ways
    limiter: Limiter  # knows the full stop
    dt: float  # time between knots [s]

    def choose(self, situation: Situation, plan: Plan | None, halt: bool = False) -> Candidate:
        """Return the way to take.

        Args:
            situation: of the robot.
            plan: of this update; None when there is none.
            halt: whether a full stop is wanted, rather than what is followed.
        """
        refused: list[Candidate] = []
        for way in self._ways(situation, plan, halt):
            if way.violation.all <= 0.0:
                return way
            refused.insert(0, way)
        return min(refused, key=lambda refused: refused.violation[:2])  # of equals the one farther down

    def _ways(self, situation: Situation, plan: Plan | None, halt: bool) -> Iterator[Candidate]:
        if plan is not None:
            yield self._planned(situation, plan, 1)
            yield from self._farther(situation, plan)
        if halt:
            yield self._way(situation, full_stop(self.limiter, situation.v, self.dt))
        if situation.followed is not None:
            followed = situation.followed.after(situation.elapsed)
            off = _SAME * self.limiter.limits.acceleration
            if np.allclose(situation.v, followed.velocity(0.0), rtol=0.0, atol=off):
                yield self._way(situation, followed)
        if not halt:
            yield self._way(situation, full_stop(self.limiter, situation.v, self.dt))

    def _farther(self, situation: Situation, plan: Plan) -> Iterator[Candidate]:
        stages = len(plan.u)
        while stages > 1:
            way = self._planned(situation, plan, stages)
            yield way
            safe = ceil(way.violation.time / self.dt) - 1  # stages
            stages = safe if safe < stages else stages // 2

    def _planned(self, situation: Situation, plan: Plan, stages: int) -> Candidate:
        """Return some stages of a plan and a full stop."""
        motion = Trajectory(self.limiter.to_rest(plan.v[: stages + 1], self.dt), self.dt)
        return self._way(situation, motion)._replace(planned=stages * self.dt)

    def _way(self, situation: Situation, motion: Trajectory) -> Candidate:
        return Candidate(motion, self.certificate.violation(motion, situation.q, situation.distances))


def full_stop(limiter: Limiter, velocity: FloatArray, dt: float) -> Trajectory:
    """Return the fastest stop from a velocity, (n,), with knots every dt [s]."""
    return Trajectory(limiter.to_rest(velocity[None], dt), dt)
