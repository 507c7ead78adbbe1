"""Capsules and boxes around the triangles of a body: the smaller, in as many pieces as is tighter."""

import itertools
from typing import Any

import numpy as np
import pinocchio as pin
from scipy.optimize import minimize

from handrail.controllers.arrays import FloatArray

_ROUND = 1.1  # a capsule is taken that is so much larger than the box
_SHORTEST = 1e-3  # half of a capsule's straight part: it has one [m]
_DIGITS = 4
_AROUND = 5e-4  # what rounding may take [m]

type Fit = tuple[float, dict[str, Any]]  # volume [m³], and the shape as a description file says it


def fitted(points: FloatArray) -> dict[str, Any]:
    """Return the capsule or the box that encloses points, (k, 3), in the axes that they are given in."""
    axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]
    axes[2] *= np.linalg.det(axes)
    box = min((_box(points, each) for each in (np.eye(3), axes.T)), key=lambda fit: fit[0])
    capsule = min((_capsule(points, axis) for axis in axes), key=lambda fit: fit[0])
    entries = (capsule if capsule[0] < _ROUND * box[0] else box)[1]
    return {name: np.round(value, _DIGITS).tolist() for name, value in entries.items()}


def _box(points: FloatArray, axes: FloatArray) -> Fit:
    """Return the box around points along some axes, the columns of a rotation, (3, 3)."""
    lower, upper = (points @ axes).min(axis=0) - _AROUND, (points @ axes).max(axis=0) + _AROUND
    entries = {"box": upper - lower, "at": axes @ (lower + upper) / 2, "rpy": pin.rpy.matrixToRpy(axes)}
    return float(np.prod(upper - lower)), entries


def _capsule(points: FloatArray, axis: FloatArray) -> Fit:
    """Return the smallest capsule near an axis: Nelder–Mead over the line, ends in closed form."""
    centre, aside = points.mean(axis=0), np.linalg.svd(axis[None])[2][1:]

    def around(line: FloatArray) -> Fit:
        direction, origin = axis + line[2:] @ aside, centre + line[:2] @ aside
        direction /= np.linalg.norm(direction)
        along = (points - origin) @ direction
        away = ((points - origin) ** 2).sum(axis=1) - along**2
        radius = float(np.sqrt(away.max()))
        bulge = np.sqrt(np.maximum(radius**2 - away, 0.0))
        first, last = (along + bulge).min(), (along - bulge).max()
        half, middle = max((last - first) / 2, _SHORTEST), origin + (first + last) / 2 * direction
        ends = {"a": middle - half * direction, "b": middle + half * direction}
        volume = float(np.pi * radius**2 * (2.0 * half + 4.0 / 3.0 * radius))
        return volume, {"capsule": radius + _AROUND} | ends

    end = minimize(lambda line: around(line)[0], np.zeros(4), method="Nelder-Mead", options={"maxiter": 300})
    return around(end.x)


def pieces(triangles: FloatArray, cuts: int, share: float, least: float) -> list[FloatArray]:
    """Return triangles cut across, where boxes around both sides are smaller than the one around all.

    Args:
        triangles: of a body, small ones, (m, 3, 3).
        cuts: one after the other, at most.
        share: of the volume around all, at which a cut is no longer made.
        least: volume that a cut has to save [m³].
    """
    local = triangles @ np.linalg.svd(np.cov(triangles.reshape(-1, 3).T))[0]
    whole, middles, best = _volume(local), local.mean(axis=1), (np.inf, np.zeros(0, bool))
    for axis, where in itertools.product(range(3), np.linspace(0.15, 0.85, 15)):
        low, high = local[..., axis].min(), local[..., axis].max()
        side = middles[:, axis] < low + where * (high - low)
        if 0 < np.count_nonzero(side) < len(side):
            best = min(best, (_volume(local[side]) + _volume(local[~side]), side), key=lambda cut: cut[0])
    if not cuts or best[0] >= min(share * whole, whole - least):
        return [triangles]
    sides = triangles[best[1]], triangles[~best[1]]
    return [piece for side in sides for piece in pieces(side, cuts - 1, share, least)]


def _volume(triangles: FloatArray) -> float:
    return float(np.prod(np.ptp(triangles, axis=(0, 1)) + 2.0 * _AROUND))
