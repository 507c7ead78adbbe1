"""The schema of one frame of a dataset: named features, and the check that a frame fits them.

Keys that begin `observation` or `action` become inputs and outputs of a LeRobot policy and must be finite;
anything else (`teleop.*`, `controller.*`, …) is kept beside them.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import Meta

from handrail.controllers.arrays import are_finite
from handrail.controllers.errors import HandrailError, shown

NUMBERS = (
    *("float32", "float64", "int8", "int16", "int32", "int64"),
    *("uint8", "uint16", "uint32", "uint64", "bool"),
)
DTYPES = (*NUMBERS, "string", "video")
POLICY_PREFIXES = ("observation", "action")
_LARGEST = 10**8  # numbers a frame and feature
_LARGE = 1e38  # what float32 holds
_can_become = cache(np.can_cast)


@dataclass(frozen=True)
class Feature:
    """One column of a dataset."""

    dtype: str
    """`float32`, `float64`, an integer type, `bool`, `string` or `video`."""
    shape: tuple[int, ...] = (1,)
    """`(n,)`; `(1,)` is kept as a scalar; `string` is `(1,)`; `video` is `(height, width, 3)`, even."""
    names: tuple[str, ...] | None = None
    """A name for each entry (for a video, each axis), or None."""

    def __post_init__(self):
        object.__setattr__(self, "shape", tuple(int(size) for size in self.shape))
        if self.names is not None:
            object.__setattr__(self, "names", tuple(str(name) for name in self.names))
        elif self.dtype == "video":
            object.__setattr__(self, "names", ("height", "width", "channels"))

    @property
    def described(self) -> dict[str, Any]:
        """The feature as LeRobot writes it into JSON."""
        names = None if self.names is None else list(self.names)
        return {"dtype": self.dtype, "shape": list(self.shape), "names": names}

    @cached_property
    def number(self) -> np.dtype[Any]:
        """The type of its numbers; a video's are bytes."""
        return np.dtype("uint8" if self.is_video else self.dtype)

    @property
    def is_video(self) -> bool:
        """Whether the feature is a camera."""
        return self.dtype == "video"

    @property
    def is_scalar(self) -> bool:
        """Whether LeRobot keeps the feature as one value a row rather than a list."""
        return self.shape == (1,)


AUTOMATIC: dict[str, Feature] = {"timestamp": Feature("float32")} | {
    name: Feature("int64") for name in ("frame_index", "episode_index", "index", "task_index")
}


class _Described(msgspec.Struct):
    dtype: str
    shape: list[Annotated[int, Meta(ge=0)]]
    names: list[Any] | dict[str, Any] | None = None


def features_of(described: Mapping[str, Mapping[str, Any]]) -> dict[str, Feature]:
    """Return the columns of a dataset as a file describes them; else a ValueError, one line."""
    found: dict[str, Feature] = {}
    for key, value in described.items():
        try:
            said = msgspec.convert(value, _Described)
            if math.prod(said.shape) > _LARGEST:
                raise ValueError(f"a shape of {_LARGEST} numbers at most, got {shown(said.shape)}")
        except ValueError as error:
            raise ValueError(f"feature {key[:60]!r}: {error}") from error
        names = said.names
        if isinstance(names, dict):  # older datasets: {"motors": [...]}
            names = next((entry for entry in names.values() if isinstance(entry, list)), None)
        if names and said.dtype not in ("video", "image") and [len(names)] != said.shape[:1]:
            names = None  # they name something else
        found[key] = Feature(said.dtype, tuple(said.shape), tuple(names) if names else None)
    return found


def video_keys(features: Mapping[str, Feature]) -> tuple[str, ...]:
    """Return the names of the cameras, in their order."""
    return tuple(key for key, feature in features.items() if feature.is_video)


def check_features(features: Mapping[str, Feature]) -> None:
    """Check a whole schema before anything is created."""
    if not features:
        raise HandrailError("features: expected at least one, got none")
    for key, feature in features.items():
        if not isinstance(key, str) or not key or "/" in key or key.startswith("."):
            raise HandrailError(f"feature {key!r}: expected a name without '/' that does not begin with '.'")
        if key in AUTOMATIC or key == "task":
            raise HandrailError(f"feature {key!r}: LeRobot writes this column itself; choose another name")
        if feature.dtype not in DTYPES:
            raise HandrailError(
                f"feature {key!r}: unknown dtype {feature.dtype!r}; expected one of {', '.join(DTYPES)}"
            )
        shape, expected = feature.shape, "(n,) with n ≥ 1"
        fits = len(shape) == 1 and shape[0] >= 1
        if feature.dtype == "string":
            fits, expected = feature.is_scalar, "(1,)"
        elif feature.is_video:  # h264 keeps colour at half the size
            fits = len(shape) == 3 and shape[2] == 3 and all(n >= 16 and n % 2 == 0 for n in shape[:2])
            expected = "(height, width, 3) with even height and width of 16 or more"
        if not fits:
            raise HandrailError(f"feature {key!r}: expected the shape {expected}, got {shape}")
        length = 3 if feature.is_video else shape[0]
        if feature.names is not None and len(feature.names) != length:
            raise HandrailError(f"feature {key!r}: expected {length} names, got {len(feature.names)}")


def check_frame(frame: Mapping[str, Any], features: Mapping[str, Feature]) -> dict[str, Any]:
    """Return a copy of one frame whose values have exactly the types and shapes of the schema.

    Args:
        frame: A value for every feature: arrays of the feature's shape, or scalars where the shape is
            `(1,)`; images are `(height, width, 3)` uint8; strings are `str`.
        features: The schema.
    """
    if frame.keys() != features.keys():
        missing = [key for key in features if key not in frame]
        extra = [str(key) for key in frame if key not in features]
        raise HandrailError(
            f"frame: expected the keys {', '.join(features)};"
            f" missing: {', '.join(missing) or 'none'}; unknown: {', '.join(extra) or 'none'}"
        )
    with np.errstate(over="ignore"):
        return {key: _check_value(key, feature, frame[key]) for key, feature in features.items()}


def _check_value(key: str, feature: Feature, value: Any) -> Any:
    if feature.dtype == "string":
        if not isinstance(value, str):
            raise HandrailError(f"frame: {key!r} expected a str, got {type(value).__name__}")
        return str(value)
    dtype = feature.number
    if type(value) is float and feature.is_scalar and dtype.kind == "f" and abs(value) < _LARGE:
        return np.array([value], dtype)
    given = np.asarray(value)
    if given.shape != feature.shape and not (given.shape == () and feature.is_scalar):
        raise HandrailError(f"frame: {key!r} expected the shape {feature.shape}, got {given.shape}")
    as_it_is = given.dtype is dtype
    if not (as_it_is or _can_become(given.dtype, dtype, "equiv" if feature.is_video else "same_kind")):
        raise HandrailError(f"frame: {key!r} expected {dtype}, got {given.dtype}")
    if feature.is_video:
        return given
    array = given.astype(dtype).reshape(feature.shape)
    if not as_it_is and dtype.kind in "iu" and not np.array_equal(array.ravel(), given.ravel()):
        raise HandrailError(f"frame: {key!r} expected values that fit {dtype}, got {given.tolist()}")
    if key.startswith(POLICY_PREFIXES) and dtype.kind == "f" and not are_finite(array):
        where = int(np.flatnonzero(~np.isfinite(array))[0])
        name = feature.names[where] if feature.names else str(where)
        raise HandrailError(
            f"frame: {key!r} expected finite values, got {array[where]} at {name} (a policy would read it)"
        )
    return array
