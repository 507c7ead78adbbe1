"""Whether what a checkpoint says of itself can be: of the right types, and no way to anywhere else."""

from collections.abc import Mapping
from typing import Any

from handrail.collect.config import FPS_RANGE
from handrail.controllers.entries import Entry, check_entries, is_amounts, is_count, is_name, is_table
from handrail.policies.imitation.config import ACTION_SPACES

_LOW, _HIGH = FPS_RANGE
_NAME = Entry("a name", is_name)
_COUNT = Entry("a whole number, 0 or more", is_count)
_SETTINGS = Entry("settings by name", is_table, needed=False)
_ENTRIES: Mapping[str, Entry] = {
    "environment": _NAME,
    "mode": _NAME,
    "robot": Entry("the name of a robot", lambda value: is_name(value) and not value.endswith(".toml")),
    "fps": Entry(
        f"a whole number from {_LOW} to {_HIGH}", lambda value: is_count(value) and _LOW <= value <= _HIGH
    ),
    "actions": Entry(f"one of {', '.join(ACTION_SPACES)}", lambda value: value in ACTION_SPACES),
    "training_seed": _COUNT,
    "dataset_draw": _COUNT,
    "trained_on": Entry("numbers by name", is_amounts),
    "policy": _NAME,
    "steps": _COUNT,
    "training": _SETTINGS,
    "versions": _SETTINGS,
    "sizes": Entry("settings by name", lambda value: _sizes(value), needed=False),
    "episodes": Entry(
        "numbers of episodes",
        lambda value: isinstance(value, list) and all(map(is_count, value)),
        needed=False,
    ),
    "data": Entry("a digest", is_name, needed=False),
}


def _sizes(value: Any) -> bool:
    return is_table(value) and is_count(value.get("steps", 0)) and is_table(value.get("options", {}))


def check_meta(content: Mapping[str, Any], where: str) -> None:
    """Check the entries of a checkpoint's `handrail.json`.

    Args:
        content: of the file, but for format and interface.
        where: it is, for the error.

    Raises:
        HandrailError: one is missing or unknown, or is not what it should be.
    """
    check_entries(content, _ENTRIES, where)
