"""A copy of a recording with few large parquet files, for training and for sharing.

One file an episode is what makes recording crash-safe; LeRobot opens thousands of them slowly. The copy has
the same rows, statistics and extra columns; videos are copied as they are. It is a finished dataset: record
into the original, and pack again.
"""

import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.arrow import numbers
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.manifest import read_manifest
from handrail.datasets.format.metadata import Totals, info_bytes, stats_bytes
from handrail.datasets.format.schema import video_keys
from handrail.datasets.format.tables import parquet_bytes, tasks_bytes
from handrail.datasets.recording.checksums import Checksums
from handrail.datasets.recording.folder import check_folders, check_target
from handrail.datasets.recording.repair import tidy_locked
from handrail.datasets.storage.atomic import explained, make_folder, write_synced
from handrail.datasets.storage.lock import DatasetLock

FILE_SIZE = 100_000_000  # [byte], LeRobot's limit


def pack(root: str | Path, output_root: str | Path) -> None:
    """Write a packed copy of a dataset that Handrail recorded; the original is repaired, else unchanged.

    Args:
        root: The dataset.
        output_root: A missing or empty folder.

    Raises:
        HandrailError: No dataset of Handrail's, an empty one, one being written, or the output is taken.
    """
    source, target = (Layout(Path(path).expanduser().absolute()) for path in (root, output_root))
    manifest = read_manifest(source)
    check_folders(source)
    check_target(target, overwrite=False)
    with explained(f"cannot pack into {str(target.root)!r}"):
        lock = DatasetLock(source.staging)
        try:
            _, totals = tidy_locked(source, manifest, Checksums(source.root))
            if not totals.episodes:
                raise HandrailError(f"dataset {str(source.root)!r}: expected episodes to pack, found none")
            places = _pack_data(source, target, totals.episodes)
            _pack_rows(source, target, places)
            _copy_videos(source, target, video_keys(manifest.features), totals.episodes)
            _write_summary(target, totals, info_bytes(manifest, totals))
        finally:
            lock.release()


def _pack_data(source: Layout, target: Layout, episodes: int) -> list[int]:
    """Write the data files, one row group an episode, and return the file number of each episode."""
    places: list[int] = []
    for number, group in enumerate(_groups([source.data(i).stat().st_size for i in range(episodes)])):
        path = target.data(number)
        make_folder(path.parent)
        schema = pq.read_schema(source.data(group[0]))
        with pq.ParquetWriter(path, schema, compression="snappy") as writer:
            for episode in group:
                writer.write_table(pq.ParquetFile(source.data(episode)).read())
        places += [number] * len(group)
    return places


def _groups(sizes: list[int]) -> Iterator[list[int]]:
    """Yield runs of episodes whose files are at most `FILE_SIZE` together."""
    group, total = [], 0
    for episode, size in enumerate(sizes):
        if group and total + size > FILE_SIZE:
            yield group
            group, total = [], 0
        group.append(episode)
        total += size
    yield group


def _pack_rows(source: Layout, target: Layout, places: list[int]) -> None:
    """Write all lines of metadata into one file."""
    lines = [pq.ParquetFile(source.row(episode)).read() for episode in range(len(places))]
    table = pa.concat_tables(lines).replace_schema_metadata(None)
    zeros = np.zeros(len(places), np.int64)
    chunks, files = np.divmod(np.array(places), 1000)
    columns = {"data/chunk_index": chunks, "data/file_index": files}
    columns |= {"meta/episodes/chunk_index": zeros, "meta/episodes/file_index": zeros}
    for name, values in columns.items():
        table = table.set_column(table.schema.get_field_index(name), name, numbers(values, pa.int64()))
    make_folder(target.row(0).parent)
    write_synced(target.row(0), parquet_bytes(table))


def _copy_videos(source: Layout, target: Layout, keys: tuple[str, ...], episodes: int) -> None:
    for key in keys:
        for episode in range(episodes):
            path = target.video(key, episode)
            make_folder(path.parent)
            shutil.copyfile(source.video(key, episode), path)


def _write_summary(target: Layout, totals: Totals, info: bytes) -> None:
    """Write `info.json` last: without it, the copy is no dataset."""
    write_synced(target.tasks, tasks_bytes(totals.tasks))
    write_synced(target.stats, stats_bytes(totals.stats or {}))
    write_synced(target.info, info)
