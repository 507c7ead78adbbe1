"""The interface of an objective: a residual of one stage, written once as a CasADi expression."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import casadi as ca
import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.symbolic import SymbolicPose, symbolic_pose


@dataclass(frozen=True)
class Stage:
    """The symbols of one stage."""

    model: RobotModel  # of the robot
    q: ca.SX  # position after the stage, (n, 1)
    v: ca.SX  # velocity after it, (n, 1)
    u: ca.SX  # acceleration during it, (n, 1)

    def pose(self, frame: str = "") -> SymbolicPose:
        """Return pose and Jacobian of a frame as expressions of q; of the hand's tool by default."""
        return symbolic_pose(self.model, self.q, frame)

    def tool(self, hand: int = 0) -> SymbolicPose:
        """Return the same of a hand's tool."""
        return self.pose(self.model.description.hands[hand].named("tool"))


@dataclass(frozen=True)
class Objective:
    """A least-squares term `½ Σ w (r(q, v, u; p) - reference)²` of every stage."""

    name: str  # what it is for; unique in a controller
    residual: Callable[[Stage, ca.SX], ca.SX]  # the expression r of a stage and the parameters p, (rows, 1)
    reference: FloatArray  # what r should be, (rows,)
    weights: Callable[[BoolArray], FloatArray]  # mask of the commanded channels (m,) → w, (rows,)
    parameters: FloatArray = field(default_factory=lambda: np.zeros(0))
    """P at the beginning, (k,); may be changed at every update."""


def switchable(objective: Objective, on: bool = False) -> Objective:
    """Return the objective with one more parameter, the last: `s (r - reference)`, 1 on, 0 off.

    Anything between scales the weight by its square: an objective that fades in.
    """

    def residual(stage: Stage, p: ca.SX) -> ca.SX:
        return p[-1] * (objective.residual(stage, p[:-1]) - objective.reference)

    return replace(
        objective,
        residual=residual,
        reference=np.zeros_like(objective.reference),
        parameters=switched(objective.parameters, on),
    )


def switched(parameters: FloatArray, on: bool = True) -> FloatArray:
    """Return the parameters of a switchable objective."""
    return np.append(parameters, float(on))
