"""The certificate that a motion is safe: no pair comes too near, no joint beyond its range."""

from typing import NamedTuple

from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.core.library import functions
from handrail.controllers.interface.trajectory import Trajectory


class Violation(NamedTuple):
    """How far a motion falls short of safety; of two the smaller is safer. 0 when it is safe [m, rad]."""

    hard: float
    """Of the hard limits of the robot with itself and with what stands still, and of the joints' range.
    Nobody else moves these: what was safe once stays safe, and nothing is worth giving it up."""
    all: float  # of all least distances
    time: float  # when it falls short first, from now; infinite where it never does [s]


class Certificate(NamedTuple):
    """Measures motions by exact distances; moving obstacles go on at constant velocity.

    A motion is safe when no pair comes below its least distance and no joint leaves its range, or, where one
    is beyond already, no farther than now. Where obstacles move, it has to be safe for some time, moving or
    waiting. Pairs are measured before they can have come below by more than half of their least distance.
    """

    collision: CollisionModel  # the pairs, and the limits of the robot
    least: FloatArray  # distance of each pair that is kept, (P,) [m]
    span: float  # time for which the robot has to be safe, where obstacles move [s]
    lag: FloatArray | None = None
    """How far the robot is from where it is expected, (n,): a motion has to be safe there, too."""

    def violation(self, motion: Trajectory, q: FloatArray, distances: FloatArray) -> Violation:
        """Return how far a motion to rest falls short of safety.

        Args:
            motion: what the robot does from now on.
            q: the position now, (n,).
            distances: the signed distances there, (P,) [m].
        """
        memory, velocities = self.collision.memory, motion.velocities
        memory.least[:], memory.start[:], memory.start_distances[:] = self.least, q, distances
        functions().motion_violation(
            memory, len(velocities), velocities, motion.dt, motion.elapsed, self.span, self.lag
        )
        self.collision.check()
        return Violation(*memory.violation.tolist())
