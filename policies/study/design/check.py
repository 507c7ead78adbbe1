"""Whether every entry of a study's file has the right type; what the values mean is checked later."""

from collections.abc import Callable, Mapping
from typing import Any

from handrail.controllers.entries import (
    Entry,
    check_entries,
    is_count,
    is_name,
    is_number,
    is_table,
    is_text,
    lists,
)


def _entry(expected: str, fits: Callable[[Any], bool], needed: bool = False) -> Entry:
    return Entry(expected, fits, needed)


def _list(value: Any) -> bool:
    return isinstance(value, list)


_COUNT = _entry("a whole number, 0 or more", is_count)
_COUNTS = _entry("whole numbers, 0 or more", lambda value: _list(value) and all(map(is_count, value)))
_NAMES = _entry("a list of names", lambda value: _list(value) and all(map(is_text, value)))
_NUMBER = _entry("a finite number", is_number)
_STUDY: Mapping[str, Entry] = {
    "modes": Entry("a list of names", lists(is_text)),
    "tasks": Entry("a table of tasks", lambda v: is_table(v) and all(map(is_name, v))),
    "baseline": Entry("a mode", is_text),
    "policy": _entry("a name", is_text),
    "seeds": _COUNTS,
    "rollouts": _COUNT,
    "budgets": _NAMES,
    "persons": _COUNT,
    "seed": _COUNT,
    "robustness": _entry("a table", is_table),
    "sweep": _entry("a table", is_table),
}
_TASK: Mapping[str, Entry] = {
    "episodes": _COUNT,
    "minutes": _NUMBER,
    "steps": _COUNT,
    "batch_size": _COUNT,
    "policy_options": _NAMES,
    "time_limit": _entry("seconds by mode", lambda v: is_table(v) and all(map(is_number, v.values()))),
    "rollout_limit": _NUMBER,
}
_ROBUSTNESS: Mapping[str, Entry] = {
    "perturbations": _NAMES,
    "protections": _NAMES,
    "rollouts": _COUNT,
    "seeds": _COUNTS,
}
_SWEEP: Mapping[str, Entry] = {
    "tasks": Entry("a list of names", lists(is_text)),
    "noises": _entry("a list of numbers", lambda value: _list(value) and all(map(is_number, value))),
    "seeds": _COUNTS,
}


def check_design(content: Mapping[str, Any], where: str) -> None:
    """Check the types of what a study's file says.

    Args:
        content: of the file.
        where: it is, for the error.

    Raises:
        HandrailError: an entry is missing, unknown, or of another type.
    """
    check_entries(content, _STUDY, where)
    for name, task in content["tasks"].items():
        check_entries(task, _TASK, f"{where}: [tasks.{name}]")
    for name, entries in (("robustness", _ROBUSTNESS), ("sweep", _SWEEP)):
        if name in content:
            check_entries(content[name], entries, f"{where}: [{name}]")
