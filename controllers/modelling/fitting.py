"""Capsules and boxes around links: the smaller; links of a body together, or in pieces, as is tighter."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from scipy.optimize import minimize

from handrail.controllers.arrays import FloatArray
from handrail.controllers.modelling.clouds import LinkCloud

_TOGETHER = 1.15  # volume of one box against two below which links share a shape
_LONG = 0.1  # side of a triangle [m]
_CUT = 0.88  # share of a box's volume that two may have which take its place
_ROUND = 1.1  # a capsule is taken that is so much larger than the box
_SHORTEST = 1e-3  # half of a capsule's straight part: it has one [m]
_DIGITS = 4
_AROUND = 5e-4  # what rounding may take [m]


@dataclass(frozen=True)
class Fit:
    """A shape around points, as a description file says it, and its volume [m³]."""

    entries: dict[str, Any]
    volume: float


def fitted(points: FloatArray) -> dict[str, Any]:
    """Return the capsule or the box that encloses points, (k, 3), in the axes that they are given in."""
    axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]
    axes[2] *= np.linalg.det(axes)
    box = min((_box(points, np.eye(3)), _box(points, axes.T)), key=lambda fit: fit.volume)
    capsule = min((_capsule(points, axis) for axis in axes), key=lambda fit: fit.volume)
    return (capsule if capsule.volume < _ROUND * box.volume else box).entries


def _box(points: FloatArray, axes: FloatArray) -> Fit:
    """Return the box around points along some axes, the columns of a rotation, (3, 3)."""
    lower, upper = (points @ axes).min(axis=0) - _AROUND, (points @ axes).max(axis=0) + _AROUND
    entries = {"box": upper - lower, "at": axes @ (lower + upper) / 2}
    if not np.allclose(axes, np.eye(3)):
        entries["rpy"] = pin.rpy.matrixToRpy(axes)
    return Fit(_rounded(entries), float(np.prod(upper - lower)))


def _capsule(points: FloatArray, axis: FloatArray) -> Fit:
    """Return the smallest capsule near an axis: Nelder–Mead over the line, ends in closed form."""
    centre, aside = points.mean(axis=0), np.linalg.svd(axis[None])[2][1:]

    def around(line: FloatArray) -> tuple[float, float, FloatArray, FloatArray]:
        direction = axis + line[2:] @ aside
        direction /= np.linalg.norm(direction)
        way = points - (centre + line[:2] @ aside)
        along = way @ direction
        away = (way**2).sum(axis=1) - along**2
        radius = float(np.sqrt(away.max()))
        bulge = np.sqrt(np.maximum(radius**2 - away, 0.0))
        first, last = (along + bulge).min(), (along - bulge).max()
        half, middle = max((last - first) / 2, _SHORTEST), (first + last) / 2
        volume = float(np.pi * radius**2 * (2.0 * half + 4.0 / 3.0 * radius))
        origin = centre + line[:2] @ aside
        return volume, radius, origin + (middle - half) * direction, origin + (middle + half) * direction

    start = np.zeros(4)
    best = minimize(lambda line: around(line)[0], start, method="Nelder-Mead", options={"maxiter": 300})
    volume, radius, a, b = around(best.x)
    return Fit(_rounded({"capsule": radius + _AROUND, "a": a, "b": b}), volume)


def shared(clouds: Sequence[LinkCloud]) -> list[tuple[str, FloatArray]]:
    """Return the links of a body that need shapes of their own, and their triangles, (m, 3, 3) on the joint.

    Two are put together while the box around both is hardly larger than their two boxes; the larger names it.
    """
    groups = [(cloud.link, cloud.triangles) for cloud in clouds]
    while len(groups) > 1:
        volumes = [_volume(triangles) for _, triangles in groups]
        both = {
            (i, j): _volume(np.vstack([groups[i][1], groups[j][1]])) / (volumes[i] + volumes[j])
            for i in range(len(groups))
            for j in range(i)
        }
        i, j = min(both, key=lambda pair: both[pair])
        if both[i, j] > _TOGETHER:
            break
        merged = groups[i if volumes[i] > volumes[j] else j][0], np.vstack([groups[i][1], groups[j][1]])
        groups = [group for k, group in enumerate(groups) if k not in (i, j)] + [merged]
    return groups


def pieces(triangles: FloatArray, least: float, cuts: int = 2) -> list[FloatArray]:
    """Return triangles cut across, where boxes around both sides are much smaller than the one around all.

    Args:
        triangles: of a link, (m, 3, 3).
        least: volume that a cut has to save [m³].
        cuts: one after the other, at most.
    """
    triangles = _fine(triangles)
    points = triangles.reshape(-1, 3)
    local = triangles @ np.linalg.svd(np.cov(points.T))[0]
    whole, middles, best = _volume(local), local.mean(axis=1), (np.inf, np.zeros(0, bool))
    for axis, share in itertools.product(range(3), np.linspace(0.15, 0.85, 15)):
        low, high = local[..., axis].min(), local[..., axis].max()
        side = middles[:, axis] < low + share * (high - low)
        if 0 < np.count_nonzero(side) < len(side):
            best = min(best, (_volume(local[side]) + _volume(local[~side]), side), key=lambda cut: cut[0])
    if not cuts or best[0] > min(_CUT * whole, whole - least):
        return [triangles]
    return [piece for side in (best[1], ~best[1]) for piece in pieces(triangles[side], least, cuts - 1)]


def _fine(triangles: FloatArray) -> FloatArray:
    """Return triangles, large ones in four, until no side is longer than 10 cm."""
    a, b, c = triangles.transpose(1, 0, 2)
    large = np.max([np.linalg.norm(side, axis=1) for side in (a - b, b - c, c - a)], axis=0) > _LONG
    if not large.any():
        return triangles
    a, b, c = triangles[large].transpose(1, 0, 2)
    d, e, f = (a + b) / 2, (b + c) / 2, (c + a) / 2
    parts = [np.stack(corners, axis=1) for corners in ((a, d, f), (d, b, e), (f, e, c), (d, e, f))]
    return np.vstack([triangles[~large], _fine(np.vstack(parts))])


def _volume(triangles: FloatArray) -> float:
    return float(np.prod(np.ptp(triangles, axis=(0, 1)) + 2.0 * _AROUND))


def _rounded(entries: dict[str, Any]) -> dict[str, Any]:
    return {name: np.round(value, _DIGITS).tolist() for name, value in entries.items()}
