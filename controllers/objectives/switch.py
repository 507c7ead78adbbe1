"""Switch an objective on and off while the controller runs."""

from dataclasses import replace

import casadi as ca
import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.objectives.objective import Objective, Stage


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
