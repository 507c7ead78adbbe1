"""The parquet files of a dataset as bytes: rows of an episode, its line of metadata, the tasks."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from handrail.datasets.format.arrow import fixed_lists, numbers, strings
from handrail.datasets.format.schema import AUTOMATIC, Feature

_PANDAS_TASKS = {
    "index_columns": ["task"],
    "column_indexes": [
        {
            "name": None,
            "field_name": None,
            "pandas_type": "unicode",
            "numpy_type": "object",
            "metadata": {"encoding": "UTF-8"},
        }
    ],
    "columns": [
        {
            "name": name,
            "field_name": name,
            "pandas_type": kind,
            "numpy_type": numpy_kind,
            "metadata": None,
        }
        for name, kind, numpy_kind in (("task_index", "int64", "int64"), ("task", "unicode", "object"))
    ],
}


def stored_features(features: Mapping[str, Feature]) -> dict[str, Feature]:
    """Return the features that have a column in the data files: all but the cameras, and LeRobot's own."""
    return {key: feature for key, feature in features.items() if not feature.is_video} | AUTOMATIC


def data_bytes(features: Mapping[str, Feature], columns: Mapping[str, Any]) -> bytes:
    """Return the data file of one episode.

    Args:
        features: The schema.
        columns: For each stored feature `(N,)` or `(N, d)` values, or a list of N strings.
    """
    schema = data_schema(features)
    arrays = [_arrow_array(columns[field.name], field.type) for field in schema]
    return parquet_bytes(pa.Table.from_arrays(arrays, schema=schema))


def data_schema(features: Mapping[str, Feature]) -> pa.Schema:
    """Return the columns of the data files, with what Hugging Face's `datasets` reads."""
    stored = stored_features(features)
    description = {"info": {"features": {key: _hf_feature(feature) for key, feature in stored.items()}}}
    fields = [pa.field(key, _arrow_type(feature)) for key, feature in stored.items()]
    return pa.schema(fields, metadata={"huggingface": json.dumps(description)})


def tasks_bytes(tasks: Sequence[str]) -> bytes:
    """Return `meta/tasks.parquet`: a pandas table whose index is the sentence."""
    arrays = [numbers(np.arange(len(tasks)), pa.int64()), strings(tasks)]
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
    with pq.ParquetWriter(
        sink,
        table.schema,
        compression="snappy",
        use_dictionary=dictionary,  # type: ignore[arg-type]
        write_statistics=statistics,
        store_schema=arrow_schema,
        write_page_checksum=True,
    ) as writer:
        writer.write_table(table)
        if not arrow_schema:  # which would carry them
            writer.add_key_value_metadata(table.schema.metadata or {})
    return sink.getvalue().to_pybytes()


def _arrow_type(feature: Feature) -> pa.DataType:
    value_type = pa.string() if feature.dtype == "string" else pa.from_numpy_dtype(np.dtype(feature.dtype))
    return value_type if feature.is_scalar else pa.list_(value_type, feature.shape[0])


def _hf_feature(feature: Feature) -> dict[str, Any]:
    value = {"dtype": feature.dtype, "_type": "Value"}
    return value if feature.is_scalar else {"feature": value, "length": feature.shape[0], "_type": "List"}


def _arrow_array(values: Any, kind: pa.DataType) -> pa.Array:
    if kind == pa.string():
        return strings(values)
    return fixed_lists(values, kind) if pa.types.is_fixed_size_list(kind) else numbers(values, kind)
