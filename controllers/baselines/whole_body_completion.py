"""Damped least squares over the whole body: the plainest completion of a tool twist."""

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import RobotModel


class WholeBodyCompletion:
    """`v = argmin ‖J v − twist‖² + λ ‖W v‖²`, `W = diag(1 / v_max)`; a completion.

    Args:
        model: of the robot.
        damping: λ.
    """

    def __init__(self, model: RobotModel, damping: float = 0.01) -> None:
        self._model = model
        self._inverse = model.description.limits.velocity**2 / damping  # of λ W², (n,)

    def __call__(self, q: FloatArray, previous: FloatArray, twist: FloatArray, duration: float) -> FloatArray:
        """Return the velocity, (n,), from `v = D Jᵀ (J D Jᵀ + I)⁻¹ twist` with `D = (λ W²)⁻¹`."""
        jacobian = self._model.jacobian(q)
        scaled = self._inverse[:, None] * jacobian.T  # (n, 6)
        return scaled @ np.linalg.solve(jacobian @ scaled + np.eye(6), twist)
