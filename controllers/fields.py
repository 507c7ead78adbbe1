"""Checking that a table of a file can become a dataclass, before it does."""

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields, replace
from typing import Any, get_type_hints

from handrail.controllers.entries import (
    Entry,
    check_entries,
    is_amounts,
    is_count,
    is_name,
    is_number,
    is_table,
    is_text,
    lists,
)


def _listed(expected: str, fits: Any) -> Entry:
    return Entry(expected, lambda value: value == [] or lists(fits)(value))


_COUNTS = _listed("whole numbers, 0 or more", is_count)
_TABLE = Entry("a table", is_table)
_OF_TYPE: Mapping[Any, Entry] = {
    int: Entry("a whole number, 0 or more", is_count),
    bool: Entry("true or false", lambda value: isinstance(value, bool)),
    float: Entry("a finite number", is_number),
    str: Entry("a name", is_name),
    tuple[int, ...]: _COUNTS,
    Sequence[int]: _COUNTS,
    tuple[float, ...]: _listed("a list of numbers", is_number),
    tuple[str, ...]: _listed("a list of names", is_text),
    Mapping[str, float]: Entry("numbers by name, 0 or more each", is_amounts),
}


def check_fields(content: Any, kind: Any, where: str, **special: Entry) -> None:
    """Check that a table has an entry for every field of a dataclass that has no default, each of its type.

    Args:
        content: the table.
        kind: the dataclass.
        where: the table is, for the error.
        special: what fields have to be of which the type does not say enough, by name.
    """
    types = get_type_hints(kind)
    entries = {
        field.name: special.get(field.name)
        or replace(
            _OF_TYPE.get(types[field.name], _TABLE),
            needed=field.default is MISSING and field.default_factory is MISSING,
        )
        for field in fields(kind)
    }
    check_entries(content, entries, where)
