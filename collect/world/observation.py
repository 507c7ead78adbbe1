"""An environment as numbers: the robot's part of the observation, and the obstacles."""

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from handrail.controllers.arrays import FloatArray, frozen
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.controller import State
from handrail.controllers.numerics.rotation import quaternion_from_matrix
from handrail.controllers.robot.model import Pose, RobotModel
from handrail.controllers.robot.shape import Obstacle, Shape

_BOUND = 100.0  # nothing here is larger, in any unit
MOST = 32  # things
WIDTH = 21  # numbers of each: kind, lengths (3), position (3), rotation (9), velocity (3), work surface, hand
_LENGTHS = {"": 0, "box": 3, "capsule": 2, "sphere": 1, "cylinder": 2}  # of a kind; "": nothing is there
_KINDS = list(_LENGTHS)


def names_of(thing: str, quantities: tuple[str, ...] = ("x", "y", "z")) -> tuple[str, ...]:
    """Return the names of a thing's numbers, of its position by default."""
    return tuple(f"{thing}.{quantity}" for quantity in quantities)


def pose_names(thing: str) -> tuple[str, ...]:
    """Return the names of a thing's position and quaternion."""
    return names_of(thing, ("x", "y", "z", "qw", "qx", "qy", "qz"))


@lru_cache(maxsize=8)
def pose_numbers(pose: Pose) -> FloatArray:
    """Return position and quaternion, (7,)."""
    return frozen(np.concatenate([pose.position, quaternion_from_matrix(pose.rotation)]))


def row_names(thing: str, count: int, quantities: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names of the numbers of so many things of one kind."""
    return tuple(name for index in range(count) for name in names_of(f"{thing}_{index}", quantities))


def padded(rows: Iterable[ArrayLike], count: int, width: int) -> FloatArray:
    """Return rows of numbers one after the other, zero for those that are missing, (count width,)."""
    numbers = np.zeros((count, width))
    for row, values in zip(numbers, rows, strict=False):
        row[:] = values
    return numbers.ravel()


class AgentObservation:
    """Joint positions, velocities, and of each hand the gripper's opening and the tool's pose, float32.

    The tool's quaternion has the sign that is nearer to the one at home: a function of the pose alone, and
    without the jump that `w ≥ 0` makes where the gripper points down.
    """

    def __init__(self, model: RobotModel) -> None:
        positions, velocities = ([f"{name}.{kind}" for name in model.joints] for kind in ("pos", "vel"))
        hands, home = model.description.hands, model.description.home
        own = ((hand.named("gripper.opening"), *pose_names(hand.named("tool"))) for hand in hands)
        self.names = (*positions, *velocities, *(name for names in own for name in names))
        tools = [model.pose(home, hand.named("tool")) for hand in hands]
        self._home = [quaternion_from_matrix(tool.rotation) for tool in tools]

    def read(self, state: State, tools: Sequence[Pose], openings: Sequence[float]) -> NDArray[np.float32]:
        """Return the numbers, (2 n + 8 h,), in the order of `names`."""
        parts: list[ArrayLike] = [state.q, state.v]
        for tool, opening, home in zip(tools, openings, self._home, strict=True):
            place, turn = (pose_numbers(tool)[part] for part in (slice(3), slice(3, None)))
            parts += [[opening], place, -turn if turn @ home < 0 else turn]
        return bounded(np.concatenate(parts))


def bounded(numbers: FloatArray) -> NDArray[np.float32]:
    """Return the numbers as float32 within the space's bounds."""
    if numbers.dot(numbers) <= _BOUND:  # they are
        return numbers.astype(np.float32)
    return np.nan_to_num(np.clip(numbers, -_BOUND, _BOUND)).astype(np.float32)


def box_space(size: int) -> spaces.Space[Any]:
    """Return the space of `size` bounded numbers."""
    return spaces.Box(-_BOUND, _BOUND, (size,), np.float32)


def to_numbers(obstacles: tuple[Obstacle, ...], tools: Sequence[str] = ("tool",)) -> NDArray[np.float32]:
    """Return obstacles as rows of numbers, (32, 21) float32, filled up with zeros.

    Args:
        obstacles: what stands around, and what is held.
        tools: names of the hands' tool frames, the numbers of which from 1 say which hand holds a thing.
    """
    if len(obstacles) > MOST:
        raise HandrailError(f"obstacles: expected {MOST} at most, got {len(obstacles)}")
    rows = np.zeros((MOST, WIDTH), np.float32)
    for row, each in zip(rows, obstacles, strict=False):
        size = np.zeros(3)
        size[: len(each.shape.size)] = each.shape.size
        hand = 1 + tools.index(each.frame) if each.held else 0
        parts = (size, each.position, each.rotation.ravel(), each.velocity, [each.work_surface, hand])
        row[:] = np.concatenate([[_KINDS.index(each.shape.kind)], *parts])
    return rows


def from_numbers(rows: ArrayLike, tools: Sequence[str] = ("tool",)) -> tuple[Obstacle, ...]:
    """Return the obstacles in rows of numbers, named by the rows' numbers; what is held moves with a tool.

    Args:
        rows: (…, 21).
        tools: names of the hands' tool frames.
    """
    table = np.asarray(rows, np.float64)
    kinds = table[:, 0] if table.ndim == 2 and table.shape[1] == WIDTH else [np.nan]
    if not set(kinds) <= set(range(len(_KINDS))):
        raise HandrailError(f"obstacles: expected rows of {WIDTH} numbers, got an array {table.shape}")
    frames = ("", *tools)
    if not set(table[:, -1]) <= set(range(len(frames))):
        got = f"got {sorted(set(table[:, -1].tolist()))}"
        raise HandrailError(f"obstacles: expected to be held by hand 1 to {len(tools)} or none, {got}")
    return tuple(_obstacle(str(i), row, frames[int(row[-1])]) for i, row in enumerate(table) if row[0])


def _obstacle(name: str, row: NDArray[np.float64], frame: str) -> Obstacle:
    kind = _KINDS[int(row[0])]
    shape = Shape(kind, row[1 : 1 + _LENGTHS[kind]])  # pyright: ignore[reportArgumentType]
    position, rotation, velocity = row[4:7], row[7:16].reshape(3, 3), row[16:19]
    surface = bool(row[19])
    return Obstacle(name, shape, position, rotation, velocity=velocity, work_surface=surface, frame=frame)
