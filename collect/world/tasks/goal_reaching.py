"""The goal-reaching protocol of the paper's Table I: goals, the planner of the tool's motion, thresholds."""

from dataclasses import dataclass
from math import asin, ceil, sqrt

import numpy as np
import pinocchio as pin

from handrail.controllers.arrays import FloatArray, frozen
from handrail.controllers.errors import HandrailError
from handrail.controllers.numerics.rotation import rotation_vector
from handrail.controllers.robot.model import Pose

STEP = 0.03  # of the simulation [s]
T_MAX = 1000  # longest episode [steps]
POSITION_TOLERANCE = 0.1  # largest d_p of a success [m]
ORIENTATION_TOLERANCE = 0.05  # largest d_r of a success
ANGLE_TOLERANCE = 2.0 * asin(sqrt(ORIENTATION_TOLERANCE))  # the same as an angle, d_r = sin²(θ/2) [rad]

_SHORTEST = 300  # shortest motion of the planner [steps]
_SPEED = 0.08  # of the planner over long distances [m/s]
type Place = tuple[float, float, float]
_LOWER, _UPPER = (-1.0, -1.0, 0.7), (1.0, 1.0, 1.0)  # of goals [m]


def sample_goal(rng: np.random.Generator, lower: Place = _LOWER, upper: Place = _UPPER) -> Pose:
    """Draw a goal: x, y ∈ [−1, 1] m, z ∈ [0.7, 1.0] m, a normalised uniform-cube axis, an angle in [0, π]."""
    position = rng.uniform(lower, upper)
    axis = rng.uniform(-1.0, 1.0, 3)
    axis /= np.linalg.norm(axis)
    return Pose(position, pin.exp3(axis * rng.uniform(0.0, np.pi)))


def pose_error(position: FloatArray, rotation: FloatArray, goal: Pose) -> tuple[float, float]:
    """Return d_p = ‖p − p_g‖ [m] and d_r = 1 − ⟨q, q_g⟩² = (3 − tr RᵀR_g) / 4, the paper's equations 7 and 8.

    Args:
        position: of the tool [m], (3,).
        rotation: world from tool, (3, 3).
        goal: to compare with.
    """
    way = position - goal.position
    trace = float(rotation.ravel() @ goal.rotation.ravel())
    return sqrt(way @ way), min(max((3.0 - trace) / 4.0, 0.0), 1.0)


def reached(d_p: float, d_r: float) -> bool:
    """Return whether errors of `pose_error` are a success."""
    return d_p <= POSITION_TOLERANCE and d_r <= ORIENTATION_TOLERANCE


@dataclass(frozen=True)
class StraightPlanner:
    """Moves the tool on a straight line with spherical interpolation, open loop, at a constant twist.

    `p(t) = p_0 + v t h`, `R(t) = exp(ω t h) R_0` for `steps` steps of h = 0.03 s; at rest from then on.
    """

    start_position: FloatArray  # where it begins [m], (3,)
    start_rotation: FloatArray  # the same, world from tool, (3, 3)
    goal: Pose  # where it ends
    velocity: FloatArray  # (v, ω), world-aligned at the tool [m/s, rad/s], (6,)
    steps: int  # how many it takes

    @classmethod
    def plan(
        cls, start_position: FloatArray, start_rotation: FloatArray, goal: Pose, speed: float = 1.0
    ) -> "StraightPlanner":
        """Plan a motion of `max(300, ⌈distance / (0.08 · 0.03)⌉) / speed` steps.

        Args:
            start_position: of the tool [m], (3,).
            start_rotation: world from tool, (3, 3).
            goal: where to go.
            speed: how many times faster than the paper's.
        """
        if not 0.0 < speed < np.inf:
            raise HandrailError(f"speed of a planner: expected a positive number, got {speed}")
        line = goal.position - start_position
        steps = ceil(max(_SHORTEST, ceil(float(np.linalg.norm(line)) / (_SPEED * STEP))) / speed)
        turn = rotation_vector(goal.rotation @ np.asarray(start_rotation).T)
        velocity = np.concatenate([line, turn]) / (steps * STEP)
        return cls(frozen(start_position), frozen(start_rotation), goal, frozen(velocity), steps)

    def twist(self, t: int) -> FloatArray:
        """Return (v, ω) from step t to the next, world-aligned at the tool [m/s, rad/s], (6,)."""
        return self.velocity if t < self.steps else np.zeros(6)

    def pose(self, t: int) -> tuple[FloatArray, FloatArray]:
        """Return the pose after t steps: position [m], (3,), and rotation world from tool, (3, 3)."""
        if t >= self.steps:
            return self.goal.position, self.goal.rotation
        time = max(t, 0) * STEP
        rotation = pin.exp3(self.velocity[3:] * time) @ self.start_rotation
        return self.start_position + self.velocity[:3] * time, rotation
