"""What stands around as an array, for who sees an environment through numbers alone; and back."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.shape import Obstacle, Shape

MOST = 32  # things
WIDTH = 21  # numbers of each: kind, lengths (3), position (3), rotation (9), velocity (3), work surface, held
_KINDS = ("", "box", "capsule", "sphere", "cylinder")  # the first one: nothing is there
_LENGTHS = {"box": 3, "capsule": 2, "sphere": 1, "cylinder": 2}


def to_numbers(obstacles: tuple[Obstacle, ...]) -> NDArray[np.float32]:
    """Return obstacles as rows of numbers, (32, 21) float32, filled up with zeros."""
    if len(obstacles) > MOST:
        raise HandrailError(f"obstacles: expected {MOST} at most, got {len(obstacles)}")
    rows = np.zeros((MOST, WIDTH), np.float32)
    for row, each in zip(rows, obstacles, strict=False):
        size = np.zeros(3)
        size[: len(each.shape.size)] = each.shape.size
        parts = (size, each.position, each.rotation.ravel(), each.velocity)
        flags = (each.work_surface, each.held)
        row[:] = [_KINDS.index(each.shape.kind), *np.concatenate(parts), *flags]
    return rows


def from_numbers(rows: ArrayLike) -> tuple[Obstacle, ...]:
    """Return the obstacles in rows of numbers, named by the rows' numbers; what is held moves with the tool.

    Args:
        rows: (…, 21).
    """
    table = np.asarray(rows, np.float64)
    kinds = table[:, 0] if table.ndim == 2 and table.shape[1] == WIDTH else [np.nan]
    if not set(kinds) <= set(range(len(_KINDS))):
        raise HandrailError(f"obstacles: expected rows of {WIDTH} numbers, got an array {table.shape}")
    return tuple(_obstacle(str(i), row) for i, row in enumerate(table) if row[0])


def _obstacle(name: str, row: NDArray[np.float64]) -> Obstacle:
    kind = _KINDS[int(row[0])]
    shape = Shape(kind, row[1 : 1 + _LENGTHS[kind]])  # pyright: ignore[reportArgumentType]
    return Obstacle(
        name,
        shape,
        position=row[4:7],
        rotation=row[7:16].reshape(3, 3),
        velocity=row[16:19],
        work_surface=bool(row[19]),
        frame="tool" if row[20] else "",
    )
