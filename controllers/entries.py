"""Checking what a file says: all entries that are needed, none that is unknown, each what it should be."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, TypeGuard

from handrail.controllers.errors import HandrailError, shown

_LARGEST = 1e6  # of a number in a file [SI units]; what is larger is a slip, or meant ill
_SMALLEST = 1e-6  # of one above 0: a limit of 5e-324 has no inverse
_LONGEST = 200  # characters of a text


@dataclass(frozen=True)
class Entry:
    """What an entry has to be.

    Attributes:
        expected: in words.
        fits: whether a value is that.
        needed: whether it has to be there.
    """

    expected: str
    fits: Callable[[Any], bool]
    needed: bool = True


def check_entries(content: Any, entries: Mapping[str, Entry], where: str) -> None:
    """Check a table of a file.

    Args:
        content: the table.
        entries: what it may have, by name.
        where: it is, for the error.
    """
    if not isinstance(content, Mapping):
        raise HandrailError(f"{where}: expected a table of {', '.join(entries)}, got {shown(content)}")
    for name in content:
        if name not in entries:
            near = get_close_matches(str(name), entries, 1)
            hint = f"; nearest: {near[0]}" if near else ""
            raise HandrailError(
                f"{where}: unknown entry {shown(name)}; expected some of {', '.join(entries)}{hint}"
            )
    for name, entry in entries.items():
        if name not in content:
            if entry.needed:
                raise HandrailError(f"{where}: expected an entry {name!r} ({entry.expected}), found none")
        elif not entry.fits(content[name]):
            raise HandrailError(f"{where}: {name}: expected {entry.expected}, got {shown(content[name])}")


def is_number(value: Any) -> bool:
    """Return whether a value is a finite number of sane size."""
    return isinstance(value, int | float) and not isinstance(value, bool) and -_LARGEST <= value <= _LARGEST


def is_positive(value: Any) -> bool:
    """Return whether a value is such a number above 0, and not next to it."""
    return is_number(value) and value >= _SMALLEST


def is_count(value: Any) -> TypeGuard[int]:
    """Return whether a value is a whole number, 0 or more."""
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 2**63


def is_name(value: Any) -> bool:
    """Return whether a value is a name that can be shown and is no path, as `base+ee` or `mask:0101`."""
    return (
        isinstance(value, str)
        and len(value) <= _LONGEST
        and all(c.isalnum() or c in "_+:,.- " for c in value)
    )


def is_text(value: Any) -> bool:
    """Return whether a value is a text in one line, and not empty."""
    return isinstance(value, str) and 0 < len(value) <= _LONGEST and value.isprintable()


def is_amounts(value: Any) -> bool:
    """Return whether a value is a table of finite numbers, 0 or more each."""
    return isinstance(value, Mapping) and all(
        isinstance(each, int | float) and not isinstance(each, bool) and 0 <= each < math.inf
        for each in value.values()
    )


def is_table(value: Any) -> bool:
    """Return whether a value is a table."""
    return isinstance(value, Mapping)


def lists(fits: Callable[[Any], bool], length: int | None = None) -> Callable[[Any], bool]:
    """Return the check that a value is a list of such, of some length or any but 0."""

    def check(value: Any) -> bool:
        right = isinstance(value, list) and (len(value) == length if length else len(value) > 0)
        return right and all(map(fits, value))

    return check
