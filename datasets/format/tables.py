"""Tables of a dataset: arrays between numpy and Arrow by their buffers, the rows of an episode, the tasks.

`pyarrow.array` and its like import pandas on their first call, 0.5 to 1 s in the middle of a recording; what
is here does not.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from handrail.controllers.regular_file import regular
from handrail.datasets.format.schema import AUTOMATIC, Feature

UNREADABLE = (OSError, pa.ArrowException, ValueError, KeyError, TypeError, AttributeError, OverflowError)
"""The errors that reading a file of a dataset can raise."""
_INDEX = {"name": None, "field_name": None, "pandas_type": "unicode", "numpy_type": "object"}
_PANDAS_TASKS = {
    "index_columns": ["task"],
    "column_indexes": [_INDEX | {"metadata": {"encoding": "UTF-8"}}],
    "columns": [
        {"name": name, "field_name": name, "pandas_type": kind, "numpy_type": numpy_kind, "metadata": None}
        for name, kind, numpy_kind in (("task_index", "int64", "int64"), ("task", "unicode", "object"))
    ],
}


def open_parquet(path: Path) -> pq.ParquetFile:
    """Open a regular file of rows; a page with another checksum than its own is refused, see `UNREADABLE`."""
    return pq.ParquetFile(regular(path), page_checksum_verification=True)


def parquet_writer(sink: pa.NativeFile, schema: pa.Schema, **settings: Any) -> pq.ParquetWriter:
    """Return what writes a file of rows: every page with a checksum, see `open_parquet`."""
    return pq.ParquetWriter(sink, schema, compression="snappy", write_page_checksum=True, **settings)


def numbers(values: Any, kind: pa.DataType) -> pa.Array:
    """Return numbers or truth values, `(N,)`, as an Arrow array of a number type or bool."""
    if kind == pa.bool_():
        return numbers(values, pa.uint8()).cast(kind)
    plain = np.ascontiguousarray(values, dtype=kind.to_pandas_dtype())
    return pa.Array.from_buffers(kind, len(plain), [None, pa.py_buffer(plain)])


def scalars(values: Sequence[str | bool | int | float | None], kind: pa.DataType) -> pa.Array:
    """Return numbers, truth values or strings of which any may be null as an Arrow array."""
    if kind == pa.string():
        builder = pa.lib.StringBuilder()  # type: ignore[attr-defined]
        builder.append_values(values)
        return builder.finish()
    known = numbers([0 if value is None else value for value in values], kind)
    there = numbers([value is not None for value in values], pa.bool_())
    return pa.Array.from_buffers(kind, len(known), [there.buffers()[1], known.buffers()[1]])


def lists(values: pa.Array, lengths: Sequence[int] | np.ndarray) -> pa.Array:
    """Return values, those of all lists one after the other, as an Arrow array of lists."""
    offsets = numbers(np.concatenate(([0], np.cumsum(lengths, dtype=int))), pa.int32())
    return pa.ListArray.from_arrays(offsets, values)


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


def column_values(table: pa.Table, name: str) -> np.ndarray:
    """Return a column of numbers, `(N,)` or `(N, d)`."""
    flat = flat_numbers(table.column(name))
    return flat if len(flat) == table.num_rows else flat.reshape(table.num_rows, -1)


def stored_features(features: Mapping[str, Feature]) -> dict[str, Feature]:
    """Return the features that have a column in the data files: all but the cameras, and LeRobot's own."""
    return {key: feature for key, feature in features.items() if not feature.is_video} | AUTOMATIC


def column_array(values: Any, kind: pa.DataType) -> pa.Array:
    """Return a column, `(N,)` or `(N, d)`, or N strings, as an Arrow array of a data file's type."""
    if pa.types.is_fixed_size_list(kind):
        return pa.FixedSizeListArray.from_arrays(numbers(np.reshape(values, -1), kind.value_type), type=kind)
    return scalars(values, kind) if kind == pa.string() else numbers(values, kind)


def data_schema(features: Mapping[str, Feature]) -> pa.Schema:
    """Return the columns of the data files, with what Hugging Face's `datasets` reads."""
    fields, described = [], {}
    for key, feature in stored_features(features).items():
        kind = pa.string() if feature.dtype == "string" else pa.from_numpy_dtype(np.dtype(feature.dtype))
        value: dict[str, Any] = {"dtype": feature.dtype, "_type": "Value"}
        if not feature.is_scalar:
            kind = pa.list_(kind, feature.shape[0])
            value = {"feature": value, "length": feature.shape[0], "_type": "List"}
        fields.append(pa.field(key, kind))
        described[key] = value
    return pa.schema(fields, metadata={"huggingface": json.dumps({"info": {"features": described}})})


def data_bytes(features: Mapping[str, Feature], columns: Mapping[str, Any]) -> bytes:
    """Return the data file of one episode.

    Args:
        features: The schema.
        columns: For each stored feature `(N,)` or `(N, d)` values, or a list of N strings.
    """
    schema = data_schema(features)
    arrays = [column_array(columns[field.name], field.type) for field in schema]
    return parquet_bytes(pa.Table.from_arrays(arrays, schema=schema))


def tasks_bytes(tasks: Sequence[str]) -> bytes:
    """Return `meta/tasks.parquet`: a pandas table whose index is the sentence."""
    arrays = [numbers(np.arange(len(tasks)), pa.int64()), scalars(tasks, pa.string())]
    table = pa.Table.from_arrays(arrays, names=["task_index", "task"])
    return parquet_bytes(table.replace_schema_metadata({"pandas": json.dumps(_PANDAS_TASKS)}))


def parquet_bytes(
    table: pa.Table, dictionary: bool | list[str] = True, statistics: bool = True, arrow_schema: bool = True
) -> bytes:
    """Return a table as the bytes of a parquet file.

    Args:
        table: The table.
        dictionary: Columns whose values are numbered, each kept once.
        statistics: Whether the least and the greatest value of each column are kept.
        arrow_schema: Whether Arrow's own description is kept too; lists of one length need it.
    """
    sink = pa.BufferOutputStream()
    settings = {"use_dictionary": dictionary, "write_statistics": statistics, "store_schema": arrow_schema}
    with parquet_writer(sink, table.schema, **settings) as writer:
        writer.write_table(table)
        if not arrow_schema:  # which would carry them
            writer.add_key_value_metadata(table.schema.metadata or {})
    return sink.getvalue().to_pybytes()
