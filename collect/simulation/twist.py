"""How a thing moves."""

from dataclasses import dataclass

import numpy as np

from handrail.controllers.arrays import FloatArray


@dataclass(frozen=True)
class Twist:
    """Linear [m/s] and angular [rad/s] velocity in the world, each (3,)."""

    linear: FloatArray
    angular: FloatArray

    @property
    def is_still(self) -> bool:
        """Whether it moves slower than 2 cm/s and 0.2 rad/s."""
        return bool(np.linalg.norm(self.linear) < 0.02 and np.linalg.norm(self.angular) < 0.2)
