"""What one frame of a dataset holds: named features, and the check that a frame fits them.

Keys that begin `observation` or `action` become inputs and outputs of a LeRobot policy and must be finite;
anything else (`teleop.*`, `controller.*`, …) is kept beside them.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from handrail.controllers.errors import HandrailError

NUMBERS = (
    "float32 float64 int8 int16 int32 int64 uint8 uint16 uint32 uint64 bool".split()  # noqa: SIM905
)
DTYPES = (*NUMBERS, "string", "video")
POLICY_PREFIXES = ("observation", "action")
OUTCOME_PREFIX = "next."  # LeRobot's name for what came of a frame


@dataclass(frozen=True)
class Feature:
    """One column of a dataset.

    Attributes:
        dtype: `float32`, `float64`, an integer type, `bool`, `string` or `video`.
        shape: `(n,)`; `(1,)` is kept as a scalar; `string` is `(1,)`; `video` is `(height, width, 3)`, even.
        names: A name for each entry (for a video, each axis), or None.
    """

    dtype: str
    shape: tuple[int, ...] = (1,)
    names: tuple[str, ...] | None = None

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

    @property
    def is_video(self) -> bool:
        """Whether the feature is a camera."""
        return self.dtype == "video"

    @property
    def is_scalar(self) -> bool:
        """Whether LeRobot keeps the feature as one value a row rather than a list."""
        return self.shape == (1,)


AUTOMATIC: dict[str, Feature] = {
    "timestamp": Feature("float32"),
    "frame_index": Feature("int64"),
    "episode_index": Feature("int64"),
    "index": Feature("int64"),
    "task_index": Feature("int64"),
}


def video_keys(features: Mapping[str, Feature]) -> tuple[str, ...]:
    """Return the names of the cameras, in their order."""
    return tuple(key for key, feature in features.items() if feature.is_video)


def check_features(features: Mapping[str, Feature]) -> None:
    """Check a whole schema before anything is created."""
    if not features:
        raise HandrailError("features: expected at least one, got none")
    for key, feature in features.items():
        _check_key(key)
        _check_feature(key, feature)


def check_frame(frame: Mapping[str, Any], features: Mapping[str, Feature]) -> dict[str, Any]:
    """Return a copy of one frame whose values have exactly the types and shapes of the schema.

    Args:
        frame: A value for every feature: arrays of the feature's shape, or scalars where the shape is
            `(1,)`; images are `(height, width, 3)` uint8; strings are `str`.
        features: The schema.
    """
    missing = [key for key in features if key not in frame]
    extra = [key for key in frame if key not in features]
    if missing or extra:
        raise HandrailError(
            f"frame: expected the keys {', '.join(features)};"
            f" missing: {', '.join(missing) or 'none'}; unknown: {', '.join(map(str, extra)) or 'none'}"
        )
    return {key: _check_value(key, feature, frame[key]) for key, feature in features.items()}


def _check_key(key: str) -> None:
    if not isinstance(key, str) or not key or "/" in key or key.startswith("."):
        raise HandrailError(f"feature {key!r}: expected a name without '/' that does not begin with '.'")
    if key in AUTOMATIC or key == "task":
        raise HandrailError(f"feature {key!r}: LeRobot writes this column itself; choose another name")


def _check_feature(key: str, feature: Feature) -> None:
    if feature.dtype not in DTYPES:
        raise HandrailError(
            f"feature {key!r}: unknown dtype {feature.dtype!r}; expected one of {', '.join(DTYPES)}"
        )
    if feature.is_video:
        _check_camera(key, feature)
    elif (
        len(feature.shape) != 1
        or feature.shape[0] < 1
        or (feature.dtype == "string" and not feature.is_scalar)
    ):
        expected = "(1,)" if feature.dtype == "string" else "(n,) with n ≥ 1"
        raise HandrailError(f"feature {key!r}: expected the shape {expected}, got {feature.shape}")
    length = 3 if feature.is_video else feature.shape[0]
    if feature.names is not None and len(feature.names) != length:
        raise HandrailError(f"feature {key!r}: expected {length} names, got {len(feature.names)}")


def _check_camera(key: str, feature: Feature) -> None:
    shape = feature.shape
    if len(shape) != 3 or shape[2] != 3 or shape[0] < 16 or shape[1] < 16 or shape[0] % 2 or shape[1] % 2:
        raise HandrailError(
            f"camera {key!r}: expected (height, width, 3) with even height and width of 16 or more,"
            f" got {shape} (h264 keeps colour at half the size)"
        )


def _check_value(key: str, feature: Feature, value: Any) -> Any:
    if feature.dtype == "string":
        if not isinstance(value, str):
            raise HandrailError(f"frame: {key!r} expected a str, got {type(value).__name__}")
        return str(value)
    array = np.asarray(value)
    expected = np.dtype("uint8" if feature.is_video else feature.dtype)
    shape = (1,) if array.shape == () and feature.is_scalar else array.shape
    if shape != feature.shape:
        raise HandrailError(f"frame: {key!r} expected the shape {feature.shape}, got {array.shape}")
    casting = "equiv" if feature.is_video else "same_kind"
    if not np.can_cast(array.dtype, expected, casting):
        raise HandrailError(f"frame: {key!r} expected {expected}, got {array.dtype}")
    if feature.is_video:
        return array
    return _check_finite(key, feature, array.reshape(shape), expected)


def _check_finite(key: str, feature: Feature, given: np.ndarray, dtype: np.dtype) -> np.ndarray:
    array = given.copy() if given.dtype == dtype else _cast(key, given, dtype)
    if key.startswith(POLICY_PREFIXES) and dtype.kind == "f" and not np.isfinite(array).all():
        where = int(np.flatnonzero(~np.isfinite(array))[0])
        name = feature.names[where] if feature.names else str(where)
        raise HandrailError(
            f"frame: {key!r} expected finite values, got {array[where]} at {name} (a policy would read it)"
        )
    return array


def _cast(key: str, given: np.ndarray, dtype: np.dtype) -> np.ndarray:
    with np.errstate(over="ignore"):
        array = given.astype(dtype)
    if dtype.kind in "iu" and not np.array_equal(array, given):
        raise HandrailError(f"frame: {key!r} expected values that fit {dtype}, got {given.tolist()}")
    return array
