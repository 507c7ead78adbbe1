"""What an objective is: a residual of one stage, written once as a CasADi expression."""

from collections.abc import Callable
from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.symbolic import SymbolicPose, symbolic_pose


@dataclass(frozen=True)
class Stage:
    """The symbols of one stage.

    Attributes:
        model: of the robot.
        q: position after the stage, (n, 1).
        v: velocity after it, (n, 1).
        u: acceleration during it, (n, 1).
    """

    model: RobotModel
    q: ca.SX
    v: ca.SX
    u: ca.SX

    def pose(self, frame: str = "tool") -> SymbolicPose:
        """Return pose and Jacobian of a frame as expressions of q."""
        return symbolic_pose(self.model, self.q, frame)


@dataclass(frozen=True)
class Objective:
    """A least-squares term `½ Σ w (r(q, v, u; p) - reference)²` of every stage.

    Attributes:
        name: what it is for; unique in a controller.
        residual: the expression r of a stage and the parameters p, (rows, 1).
        reference: what r should be, (rows,).
        weights: mask of the commanded channels (m,) → w, (rows,).
        parameters: p at the beginning, (k,); may be changed at every update.
    """

    name: str
    residual: Callable[[Stage, ca.SX], ca.SX]
    reference: FloatArray
    weights: Callable[[BoolArray], FloatArray]
    parameters: FloatArray = field(default_factory=lambda: np.zeros(0))
