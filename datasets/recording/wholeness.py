"""Whether one saved episode is whole: its line of metadata, its rows, its videos.

A file with the checksum that it had when it was saved is whole. One with another was rewritten, by LeRobot's
`reencode_videos` for instance, or is damaged: it is whole if it still decodes to the episode's frames.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.arrow import flat_numbers
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import EpisodeRecord, FileSeal, read_record
from handrail.datasets.format.schema import AUTOMATIC, video_keys
from handrail.datasets.format.stats import column_stats
from handrail.datasets.format.tables import stored_features
from handrail.datasets.format.video import decoded_stats

UNREADABLE = (OSError, pa.ArrowException, ValueError, KeyError, TypeError, AttributeError, OverflowError)
Seals = Callable[[Path], FileSeal]
_KEPT = ("min", "max", "mean", "std")
_SHADE = 0.03  # of full brightness: how far encoding anew may move the mean of a colour


@dataclass(frozen=True)
class EpisodeState:
    """What became of a saved episode.

    Attributes:
        number: Of the episode.
        record: Its line of metadata; None if that is missing or cannot be read.
        fault: Why it is not whole, or "".
        rewritten: Files with another checksum that decode to the right frames, with their seals now.
    """

    number: int
    record: EpisodeRecord | None
    fault: str = ""
    rewritten: dict[str, FileSeal] = field(default_factory=dict)


def examine(
    layout: Layout,
    manifest: Manifest,
    number: int,
    start: int | None,
    seal_of: Seals,
    find: Callable[[str], Path] | None = None,
) -> EpisodeState:
    """Return the state of one episode.

    Args:
        layout: The dataset, or a folder that holds its files at the same places.
        manifest: The dataset's schema.
        number: Of the episode.
        start: Index of its first frame; None if the episode before does not tell.
        seal_of: Gives the seal of a file.
        find: Gives the path of a file of the episode; where it belongs by default.

    Raises:
        HandrailError: Another tool wrote its line of metadata.
    """
    row = layout.row(number)
    try:
        record = read_record(row, with_stats=True)
    except FileNotFoundError:
        return EpisodeState(number, None, f"{layout.relative(row)} is missing")
    except UNREADABLE as error:
        return EpisodeState(number, None, f"{layout.relative(row)} cannot be read ({first_line(error)})")
    fault = _line_fault(layout, manifest, record, number, start)
    rewritten: dict[str, FileSeal] = {}
    for name, seal in record.files.items():
        if not fault:
            path = find(name) if find else layout.root / name
            fault = _file_fault(path, name, manifest, record, seal, seal_of, rewritten)
    return EpisodeState(number, record, fault, rewritten)


def first_line(error: BaseException) -> str:
    """Return the first line of what an error says."""
    return str(error).partition("\n")[0]


def _line_fault(
    layout: Layout, manifest: Manifest, record: EpisodeRecord, number: int, start: int | None
) -> str:
    row = layout.relative(layout.row(number))
    place = (number, record.start if start is None else start)
    if (record.episode, record.start) != place or record.length < 1:
        return f"{row} is not the line of episode {number}, frame {place[1]} on"
    expected = {layout.data(number), *(layout.video(key, number) for key in video_keys(manifest.features))}
    if {layout.root / name for name in record.files} != expected:
        return f"{row} names files that are not those of episode {number}"
    return ""


def _file_fault(
    path: Path,
    name: str,
    manifest: Manifest,
    record: EpisodeRecord,
    seal: FileSeal,
    seal_of: Seals,
    rewritten: dict[str, FileSeal],
) -> str:
    """Return what is wrong with a file, or ""; one that is whole though rewritten is added to those."""
    try:
        found = seal_of(path)
        if found == seal:
            return ""
        fault = _content_fault(path, name, manifest, record)
    except FileNotFoundError:
        return f"{name} is missing"
    except (HandrailError, *UNREADABLE) as error:
        fault = first_line(error)
    if fault:
        size = path.stat().st_size
        said = f"has {size} bytes, expected {seal.size}" if size != seal.size else "has other content"
        return f"{name} {said} ({fault})"
    rewritten[name] = found
    return ""


def _content_fault(path: Path, name: str, manifest: Manifest, record: EpisodeRecord) -> str:
    if name.startswith("data/"):
        return _rows_fault(path, manifest, record)
    key = name.split("/")[1]
    height, width, _ = manifest.features[key].shape
    now, saved = decoded_stats(path, record.length, height, width), (record.stats or {})[key]
    same = all(np.abs(now[name] - saved[name]).max() < _SHADE for name in ("mean", "std"))
    return "" if same else "it shows other pictures than were saved"


def _rows_fault(path: Path, manifest: Manifest, record: EpisodeRecord) -> str:
    """Return how rows that can be read differ from those that were saved, or ""."""
    with pq.ParquetFile(path) as file:
        table = file.read(use_threads=False)
    lacking = [name for name in stored_features(manifest.features) if name not in table.column_names]
    if lacking or table.num_rows != record.length:
        return f"{table.num_rows} rows instead of {record.length}" + "".join(f", no {n}" for n in lacking[:1])
    frames = np.arange(record.length)
    expected = {"frame_index": frames, "index": frames + record.start, "episode_index": record.episode}
    for name, values in expected.items():
        if not np.array_equal(_values(table, name), np.broadcast_to(values, frames.shape)):
            return f"{name} is not that of episode {record.episode}"
    for name, saved in (record.stats or {}).items():
        if name in table.column_names and name not in AUTOMATIC and _differ(_values(table, name), saved):
            return f"{name} holds other numbers than were saved"
    return ""


def _values(table: pa.Table, name: str) -> np.ndarray:
    """Return a column of numbers, (N,) or (N, d)."""
    flat = flat_numbers(table.column(name))
    return flat if len(flat) == table.num_rows else flat.reshape(table.num_rows, -1)


def _differ(values: np.ndarray, saved: dict[str, np.ndarray]) -> bool:
    now = column_stats(values)
    return not all(np.allclose(now[name], saved[name].ravel(), rtol=1e-5, atol=1e-8) for name in _KEPT)
