"""Whether what a checkpoint says of itself can be: of the right types, and no way to anywhere else."""

import math
from collections.abc import Callable, Mapping
from typing import Any

from handrail.collect.config import FPS_RANGE
from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.config import ACTION_SPACES

_LONGEST = 200  # characters of a name


def _name(value: Any) -> bool:
    """Return whether a text can be shown and is no path; a mode may be `base+ee` or `mask:0101`."""
    return (
        isinstance(value, str)
        and len(value) <= _LONGEST
        and all(c.isalnum() or c in "_+:,.- " for c in value)
    )


def _robot(value: Any) -> bool:
    return _name(value) and not value.endswith(".toml")


def _count(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 2**63


def _rate(value: Any) -> bool:
    return _count(value) and FPS_RANGE[0] <= value <= FPS_RANGE[1]


def _amounts(value: Any) -> bool:
    return isinstance(value, Mapping) and all(
        isinstance(each, int | float) and not isinstance(each, bool) and 0 <= each < math.inf
        for each in value.values()
    )


def _settings(value: Any) -> bool:
    return isinstance(value, Mapping)


_ENTRIES: Mapping[str, tuple[Callable[[Any], bool], str]] = {
    "environment": (_name, "a name"),
    "mode": (_name, "a name"),
    "robot": (_robot, "the name of a robot"),
    "fps": (_rate, f"a whole number from {FPS_RANGE[0]} to {FPS_RANGE[1]}"),
    "actions": (lambda value: value in ACTION_SPACES, f"one of {', '.join(ACTION_SPACES)}"),
    "training_seed": (_count, "a whole number, 0 or more"),
    "dataset_draw": (_count, "a whole number, 0 or more"),
    "trained_on": (_amounts, "numbers by name"),
    "policy": (_name, "a name"),
    "steps": (_count, "a whole number, 0 or more"),
    "training": (_settings, "settings by name"),
    "versions": (_settings, "versions by name"),
    "sizes": (_settings, "settings by name"),
    "episodes": (lambda value: isinstance(value, list) and all(map(_count, value)), "numbers of episodes"),
    "data": (_name, "a digest"),
}


def check_meta(content: Mapping[str, Any], where: str) -> None:
    """Check the entries of a checkpoint's `handrail.json`.

    Args:
        content: of the file, but for format and interface.
        where: it is, for the error.

    Raises:
        HandrailError: one is unknown, or is not what it should be.
    """
    for name, value in content.items():
        if name not in _ENTRIES:
            raise HandrailError(f"{where}: expected no entry {name!r:.80}")
        fits, expected = _ENTRIES[name]
        if not fits(value):
            raise HandrailError(f"{where}: {name}: expected {expected}, got {value!r:.80}")
