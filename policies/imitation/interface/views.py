"""Where a robot's cameras are, and what a place in their pictures says of where a thing is.

n ∝ (a s u, −s v, −1)                       the ray through a place, u to the right, v down, −1 to 1,
p = c + ρ R n                               of a camera at c with axes R; s = tan(fovy / 2), a = w / h
Σ = 4 (σ_l² (1 − n nᵀ) + σ_d² n nᵀ)         how far off that is: across the ray, along it
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import torch
from torch import Tensor

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.parts import Camera
from handrail.controllers.typed import AtLeastOne, Number, Positive
from handrail.policies.imitation.interface.relative import RobotPose

_FINEST = 2e-3  # how far something is off at least [m]
_SPREAD = 4.0  # variance over σ², of a density ∝ e^(−|e| / σ) in space
_RIGID = 1e-5  # [m, 1]
_Place = tuple[Number, Number, Number]
PLACED = 5  # numbers: u, v, log ρ, log σ_l, log σ_d


@dataclass(frozen=True)
class CameraMount:
    """A camera that is fixed to the base or to the tool, and its pictures."""

    on: Literal["base", "tool"]
    position: _Place
    """There [m]."""
    axes: tuple[_Place, _Place, _Place]
    """Rows of the matrix whose columns are right, up and back."""
    slope: Positive
    """s."""
    size: tuple[AtLeastOne, AtLeastOne]
    """Height and width of the pictures [px]."""

    @classmethod
    def of(cls, camera: Camera, model: RobotModel, size: tuple[int, int]) -> "CameraMount":
        """Return how a camera of a robot is fixed."""
        description = model.description
        rng = np.random.default_rng(0)
        tries = [description.home, description.home + 0.1 * rng.normal(size=len(description.home))]
        found: dict[str, list[FloatArray]] = {"base": [], "tool": []}
        for q in tries:
            at, tool = model.pose(q, camera.frame), model.pose(q)
            pose = RobotPose(_base(model, q)[None], tool.position[None], tool.rotation[None])
            place = at.position + at.rotation @ camera.position
            for on, rows in found.items():
                origin, turn = _frame(pose, on)
                axes = turn[0].T @ at.rotation @ camera.axes
                rows.append(np.vstack([turn[0].T @ (place - origin[0]), axes]))
        for on, (first, second) in found.items():
            if np.allclose(first, second, atol=_RIGID):
                position, *axes = (tuple(map(float, row)) for row in first)
                slope = float(np.tan(np.deg2rad(camera.fovy) / 2))
                return cls(on, position, tuple(axes), slope, size)  # pyright: ignore[reportArgumentType]
        words = "expected one that is fixed to the base or to the tool"
        raise HandrailError(f"camera {camera.name} of {description.name}: {words}")

    @property
    def numbers(self) -> FloatArray:
        """Position, axes and slope, (13,)."""
        return np.array([*self.position, *np.ravel(self.axes), self.slope])

    def view(self, pose: RobotPose) -> tuple[FloatArray, FloatArray]:
        """Return where the camera is, c (T, 3) and R (T, 3, 3)."""
        origin, turn = _frame(pose, self.on)
        return origin + turn @ np.array(self.position), turn @ np.array(self.axes)


def placed(numbers: Tensor, slope: Tensor, size: tuple[int, int]) -> tuple[Tensor, Tensor, Tensor]:
    """Return ρ n, (T, 3), n, (T, 3), and log σ_l, log σ_d, (T, 2), of `PLACED` numbers, (T, 5).

    Args:
        numbers: of a thing.
        slope: s, (T,).
        size: height and width of the pictures.
    """
    u, v = numbers[:, 0] * slope * (size[1] / size[0]), -numbers[:, 1] * slope
    ray = torch.nn.functional.normalize(torch.stack([u, v, -torch.ones_like(u)], 1), dim=1)
    return numbers[:, 2:3].clamp(-4.0, 3.0).exp() * ray, ray, numbers[:, 3:5].clamp(-7.0, 2.0)


def facing(ways: FloatArray) -> FloatArray:
    """Return the least rotations that turn a camera towards ways in its axes, (T, 3) to (T, 3, 3)."""
    n = ways / np.linalg.norm(ways, axis=1, keepdims=True)
    x, y, toward = n[:, 0], n[:, 1], np.maximum(1.0 - n[:, 2], 1e-9)
    side = np.stack([1.0 - x * x / toward, -x * y / toward, x], 1)
    up = np.stack([-x * y / toward, 1.0 - y * y / toward, y], 1)
    return np.stack([side, up, -n], 2)


def in_picture(place: Tensor, slope: Tensor, size: tuple[int, int]) -> Tensor:
    """Return u, v, (T, 2), of places in a camera's axes, (T, 3); infinity behind it; as of `placed`."""
    depth = torch.where(place[:, 2] < 0.0, -place[:, 2], 0.0) * slope
    return torch.stack([place[:, 0] / depth * (size[0] / size[1]), -place[:, 1] / depth], 1)


def spread(rays: FloatArray, widths: FloatArray) -> FloatArray:
    """Return Σ, (T, 3, 3), along rays, (T, 3), of log σ_l and log σ_d, (T, 2)."""
    across, along = np.maximum(np.exp(2.0 * widths), _FINEST**2).T[..., None, None]
    outer = rays[:, :, None] * rays[:, None, :]
    return _SPREAD * (across * (np.eye(3) - outer) + along * outer)


def _frame(pose: RobotPose, on: str) -> tuple[FloatArray, FloatArray]:
    if on == "tool":
        return pose.tool, pose.rotation
    return np.column_stack([pose.base[:, :2], np.zeros(len(pose.base))]), pose.matrices


def _base(model: RobotModel, q: FloatArray) -> FloatArray:
    return q[:3] if len(model.description.base.joints) else np.zeros(3)
