"""The fields of `info.json`, each checked where it enters: a dataset may come from anybody."""

import math
from collections.abc import Mapping
from typing import Any

from handrail.datasets.format.schema import Feature

MOST_EPISODES, MOST_FRAMES = 10**7, 10**12
_FASTEST = 10_000  # [Hz]
_LARGEST = 10**8  # numbers a frame and feature


def whole_number(content: Mapping[str, Any], name: str, most: int) -> int:
    """Return a whole number from 0 to `most`.

    Raises:
        KeyError: There is none.
        ValueError: It is something else; one line.
    """
    value = content[name]
    if type(value) is not int or not 0 <= value <= most:
        raise ValueError(f"{name}: expected a whole number from 0 to {most}, got {_shown(value)}")
    return value


def rate(content: Mapping[str, Any]) -> int:
    """Return the frames a second [Hz]; LeRobot's are whole.

    Raises:
        KeyError: There are none.
        ValueError: It is no such number; one line.
    """
    value = content["fps"]
    if type(value) not in (int, float) or not 0 < value <= _FASTEST:
        raise ValueError(f"fps: expected a number above 0, at most {_FASTEST}, got {_shown(value)}")
    return value


def features(content: Mapping[str, Any]) -> dict[str, Feature]:
    """Return the columns.

    Raises:
        KeyError: One lacks its type or shape, or there are none.
        ValueError: One is described by something else; one line.
    """
    found = content["features"]
    if not isinstance(found, dict) or not all(isinstance(value, dict) for value in found.values()):
        raise ValueError(f"features: expected a description of each column, got {_shown(found)}")
    return {key: _feature(key, value) for key, value in found.items()}


def _feature(key: str, value: dict[str, Any]) -> Feature:
    dtype, shape, names = value["dtype"], value["shape"], value.get("names")
    if isinstance(names, dict):  # older datasets: {"motors": [...]}
        names = next((entry for entry in names.values() if isinstance(entry, list)), None)
    if not isinstance(dtype, str) or not isinstance(names, list | None):
        raise ValueError(f"feature {key[:60]!r}: expected a type and names, got {_shown([dtype, names])}")
    sizes = shape if isinstance(shape, list) else [-1]
    if not all(type(size) is int and size >= 0 for size in sizes) or math.prod(sizes) > _LARGEST:
        raise ValueError(f"feature {key[:60]!r}: expected a shape, got {_shown(shape)}")
    if names and dtype not in ("video", "image") and [len(names)] != sizes[:1]:
        names = None  # they name something else
    return Feature(dtype, tuple(sizes), tuple(names) if names else None)


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:60]}…"
