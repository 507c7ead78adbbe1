"""Extra columns of an episode's metadata: success, operator, seed and whatever else a session knows.

The first saved episode fixes which columns there are and their types: one parquet schema for all episodes.
Strings are never null (None becomes ""); other columns may be left out later.
"""

from collections.abc import Mapping

import numpy as np
import pyarrow as pa

from handrail.controllers.errors import HandrailError

Scalar = str | bool | int | float
CLIENT = "robot_client"  # which of LeRobot's robots was driven through its client; empty or missing for none
ColumnTypes = dict[str, pa.DataType]

RESERVED = ("episode_index", "tasks", "length", "dataset_from_index", "dataset_to_index")
_TYPES: dict[type, pa.DataType] = {bool: pa.bool_(), int: pa.int64(), float: pa.float64(), str: pa.string()}


def is_extra(column: str) -> bool:
    """Return whether a column of `meta/episodes` is none of LeRobot's own."""
    return "/" not in column and column not in RESERVED


def plain_columns(columns: Mapping[str, Scalar | None]) -> dict[str, Scalar]:
    """Return the columns with plain Python values."""
    for name in columns:
        if not isinstance(name, str) or not name or not is_extra(name):
            raise HandrailError(
                f"episode column {name!r}: expected a name without '/' other than {', '.join(RESERVED)}"
            )
    return {name: _plain(name, value) for name, value in columns.items()}


def column_types(columns: Mapping[str, Scalar]) -> ColumnTypes:
    """Return the types that the first episode's columns fix."""
    return {name: _TYPES[type(value)] for name, value in columns.items()}


def fit_columns(columns: Mapping[str, Scalar], types: ColumnTypes) -> dict[str, Scalar | None]:
    """Return one value for each column that the dataset has.

    Args:
        columns: Plain values.
        types: What the first episode fixed.
    """
    unknown = [name for name in columns if name not in types]
    if unknown:
        raise HandrailError(
            f"episode column {unknown[0]!r} is new: expected those of the first episode, {', '.join(types)}"
        )
    return {name: _fit(name, columns.get(name), kind) for name, kind in types.items()}


def _plain(name: str, value: object) -> Scalar:
    if isinstance(value, np.generic):
        value = value.item()
    if value is None:
        return ""
    if type(value) not in _TYPES:
        raise HandrailError(
            f"episode column {name!r}: expected str, bool, int or float, got {type(value).__name__}"
        )
    return value  # type: ignore[return-value]


def _fit(name: str, value: Scalar | None, kind: pa.DataType) -> Scalar | None:
    if value is None or value == "":
        return "" if kind == pa.string() else None
    if kind == pa.float64() and type(value) is int:
        return float(value)
    if _TYPES[type(value)] != kind:
        raise HandrailError(f"episode column {name!r}: expected {kind} as in earlier episodes, got {value!r}")
    return value
