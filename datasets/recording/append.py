"""Saving a copy of an episode, of this dataset or of one like it, under a dataset's next number."""

import os
import shutil
from dataclasses import replace as changed
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from handrail.datasets.format.arrow import numbers
from handrail.datasets.format.columns import Scalar, fit_columns
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import (
    EpisodeRecord,
    FileSeal,
    Totals,
    read_column_types,
    row_bytes,
)
from handrail.datasets.format.schema import video_keys
from handrail.datasets.format.stats import column_stats
from handrail.datasets.format.tables import parquet_bytes
from handrail.datasets.storage.atomic import move, remove, sync_file, write_synced


def append_episode(
    layout: Layout, folder: Layout, manifest: Manifest, old: EpisodeRecord, totals: Totals, origin: str
) -> EpisodeRecord:
    """Save a copy of an episode under the next number, in the order in which the writer saves one.

    Args:
        layout: Of the dataset, whose staging folder is there.
        folder: Where the episode is, at the places of a dataset.
        manifest: The schema of both.
        old: The episode's line of metadata, with statistics.
        totals: What the dataset's episodes add up to.
        origin: What the new line says of the one that it had, or "".

    Returns:
        The new line.

    Raises:
        HandrailError, ValueError: It has columns that the dataset does not have, or tasks that do not add up.
    """
    types = read_column_types(layout.row(totals.episodes - 1) if totals.episodes else folder.row(old.episode))
    columns: dict[str, Scalar] = {name: value for name, value in old.columns.items() if value is not None}
    extras = fit_columns(columns, types)
    number, staging = totals.episodes, layout.staging
    streams = {layout.data(number): staging / "data.parquet"}
    table, stats = _renumbered(folder.data(old.episode), old, totals)
    write_synced(staging / "data.parquet", parquet_bytes(table))
    for key in video_keys(manifest.features):
        streams[layout.video(key, number)] = staging / f"{key}.mp4"
        _copy(folder.video(key, old.episode), staging / f"{key}.mp4")
    seals = {layout.relative(path): FileSeal.of(staged) for path, staged in streams.items()}
    record = changed(
        old,
        episode=number,
        start=totals.frames,
        stats={**(old.stats or {}), **stats},
        columns=extras,
        files=seals,
    )
    write_synced(staging / "row.parquet", row_bytes(manifest, record, types, origin))
    for path, staged in streams.items():
        move(staged, path)
    move(staging / "row.parquet", layout.row(number))  # the commit
    return record


def _renumbered(data: Path, old: EpisodeRecord, totals: Totals) -> tuple[pa.Table, dict[str, Any]]:
    """Return an episode's rows with the counters of its new place, and the statistics of these."""
    with pq.ParquetFile(data) as file:
        table = file.read(use_threads=False)
    tasks = table.column("task_index").to_pylist()
    places = {task: place for place, task in enumerate(totals.with_tasks(old.tasks))}
    new = {task: places[name] for task, name in zip(dict.fromkeys(tasks), old.tasks, strict=True)}
    counters = {
        "episode_index": np.full(old.length, totals.episodes),
        "index": np.arange(old.length) + totals.frames,
        "task_index": np.array([new[task] for task in tasks]),
    }
    for name, values in counters.items():
        place = table.schema.get_field_index(name)
        table = table.set_column(place, table.schema.field(place), numbers(values, pa.int64()))
    return table, {name: column_stats(values) for name, values in counters.items()}


def _copy(source: Path, target: Path) -> None:
    """Give a file a second name, or copy it where the file system has no such thing."""
    remove(target)
    try:
        os.link(source, target)
    except OSError:
        shutil.copyfile(source, target)
    sync_file(target)
