"""Arrow arrays from numpy arrays and strings, by their buffers, and back.

`pyarrow.array` imports pandas on its first call, 0.5 to 1 s in the middle of a recording, and so does
`to_numpy`; this does not.
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import pyarrow as pa


def numbers(values: np.ndarray, kind: pa.DataType) -> pa.Array:
    """Return numbers or truth values as an Arrow array.

    Args:
        values: `(N,)`, cast to `kind`.
        kind: A number type or bool.
    """
    if kind == pa.bool_():
        return numbers(values, pa.uint8()).cast(kind)
    plain = np.ascontiguousarray(values, dtype=kind.to_pandas_dtype())
    return pa.Array.from_buffers(kind, len(plain), [None, pa.py_buffer(plain)])


def strings(values: Sequence[str]) -> pa.Array:
    """Return strings as an Arrow array."""
    encoded = [value.encode() for value in values]
    offsets = np.concatenate(([0], np.cumsum([len(value) for value in encoded]))).astype(np.int32)
    buffers = [None, pa.py_buffer(offsets), pa.py_buffer(b"".join(encoded))]
    return pa.Array.from_buffers(pa.string(), len(encoded), buffers)


def fixed_lists(values: np.ndarray, kind: pa.DataType) -> pa.Array:
    """Return rows of numbers as an Arrow array of lists of one length.

    Args:
        values: `(N, d)`.
        kind: The list type.
    """
    flat = numbers(np.reshape(values, -1), kind.value_type)  # type: ignore[attr-defined]
    return pa.FixedSizeListArray.from_arrays(flat, type=kind)


def lists(values: pa.Array, lengths: Sequence[int]) -> pa.Array:
    """Return values as an Arrow array of lists.

    Args:
        values: Those of all lists, one after the other.
        lengths: Of each list.
    """
    offsets = numbers(np.concatenate(([0], np.cumsum(lengths, dtype=int))), pa.int32())
    return pa.ListArray.from_arrays(offsets, values)


def equal_lists(values: pa.Array, length: int) -> pa.Array:
    """Return values as an Arrow array of lists that are equally long, as `lists` would."""
    return pa.ListArray.from_arrays(_equal_offsets(len(values), length), values)


@lru_cache(maxsize=256)
def _equal_offsets(count: int, length: int) -> pa.Array:
    return numbers(np.arange(0, count + 1, length), pa.int32())


def scalars(values: Sequence[str | bool | int | float | None], kind: pa.DataType) -> pa.Array:
    """Return numbers, truth values or strings of which any may be null as an Arrow array."""
    if kind == pa.string():
        known = strings(["" if value is None else str(value) for value in values])
    else:
        known = numbers(np.array([0 if value is None else value for value in values]), kind)
    there = numbers(np.array([value is not None for value in values]), pa.bool_())
    return pa.Array.from_buffers(kind, len(known), [there.buffers()[1], *known.buffers()[1:]])


def plain_values(column: pa.ChunkedArray) -> list:
    """Return a column as Python values; equal texts are one object, since episodes repeat their settings."""
    if column.type != pa.string():
        return column.to_pylist()
    encoded = column.combine_chunks().dictionary_encode()
    texts = encoded.dictionary.to_pylist()
    return [None if place is None else texts[place] for place in encoded.indices.to_pylist()]


def to_numpy(values: pa.Array) -> np.ndarray:
    """Return an Arrow array of numbers or truth values as a numpy array, `(N,)`; nulls become NaN."""
    if values.null_count:
        return values.to_numpy(zero_copy_only=False)
    truth = values.type == pa.bool_()
    found = np.from_dlpack(values.cast(pa.uint8()) if truth else values)  # type: ignore[arg-type]
    return found != 0 if truth else found


def flat_numbers(column: pa.ChunkedArray) -> np.ndarray:
    """Return the numbers of a column, those of nested lists one after the other."""
    values = column.combine_chunks()
    while isinstance(values, pa.ExtensionArray) or pa.types.is_nested(values.type):
        values = values.storage if isinstance(values, pa.ExtensionArray) else values.flatten()
    return to_numpy(values)
