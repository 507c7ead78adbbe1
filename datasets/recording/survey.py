"""What lies in the folder of a dataset that Handrail wrote: its episodes, whole or not, and the rest.

A file with the checksum that it had when it was saved is whole. One with another was rewritten, by LeRobot's
`reencode_videos` for instance, or is damaged: it is whole if it still decodes to the episode's frames.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.arrow import flat_numbers
from handrail.datasets.format.layout import Layout, episode_of
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import EpisodeRecord, FileSeal, Totals, read_record
from handrail.datasets.format.schema import AUTOMATIC, video_keys
from handrail.datasets.format.stats import column_stats
from handrail.datasets.format.tables import stored_features
from handrail.datasets.format.video import decoded_stats
from handrail.datasets.storage.strict_json import read_json

UNREADABLE = (OSError, pa.ArrowException, ValueError, KeyError, TypeError, AttributeError, OverflowError)
Seals = Callable[[Path], FileSeal]
_KEPT = ("min", "max", "mean", "std")
_SHADE = 0.03  # of full brightness: how far encoding anew may move the mean of a colour
_STREAMS = ("videos/*/*/*.mp4", "data/*/*.parquet")
_GAP = 10_000  # episodes; more that nothing is left of are a name made up
_ROWS = "meta/episodes/*/*.parquet"


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


@dataclass(frozen=True)
class Survey:
    """What was found.

    Attributes:
        states: Of the saved episodes, in order.
        totals: What the episodes before the first one without a line of metadata add up to.
        absent: How many more episodes `info.json` counts, of which nothing is there.
        leftovers: Files of the one episode that a crash cut short before it was saved.
        strays: Files with names that no episode has; LeRobot would read them.
    """

    states: tuple[EpisodeState, ...]
    totals: Totals
    absent: int
    leftovers: tuple[Path, ...]
    strays: tuple[Path, ...]

    @property
    def damaged(self) -> tuple[EpisodeState, ...]:
        """The episodes that are not whole."""
        return tuple(state for state in self.states if state.fault)

    @property
    def rewritten(self) -> tuple[EpisodeState, ...]:
        """The whole episodes with files that another tool wrote anew."""
        return tuple(state for state in self.states if state.rewritten and not state.fault)

    @property
    def whole(self) -> bool:
        """Whether every episode that was saved is there and whole."""
        return not (self.damaged or self.absent)

    @property
    def counted(self) -> bool:
        """Whether the totals are those of every saved episode."""
        return self.totals.episodes == len(self.states) and not self.absent

    def faults(self) -> list[str]:
        """Return what is wrong, one text an episode."""
        said = [f"episode {state.number}: {state.fault}" for state in self.damaged]
        count = len(self.states)
        return said + ([f"episodes {count} to {count + self.absent - 1}: missing"] if self.absent else [])


def survey(layout: Layout, manifest: Manifest, seal_of: Seals) -> Survey:
    """Look at everything, change nothing.

    Raises:
        HandrailError: Another tool has added episodes, or a file has the number of an absurd one.
    """
    rows, streams = _found(layout, _ROWS), [p for pattern in _STREAMS for p in _found(layout, pattern)]
    saved, counted = _saved_by_lines(rows), _saved_in_info(layout)
    beyond = {number for number in map(episode_of, streams) if number is not None and number >= saved}
    interrupted = beyond == {saved} and counted is not None and counted <= saved  # a crash: the next one's
    count = saved if interrupted or not beyond else max(beyond) + 1
    if count > 10 * len({*map(episode_of, (*rows, *streams))}) + _GAP:
        raise HandrailError(
            f"dataset {str(layout.root)!r}: a file says that it is of episode {count - 1}, with next to none"
            " before it; move it away"
        )
    states, totals = _states(layout, manifest, count, seal_of)
    return Survey(
        states,
        totals,
        absent=max(0, (counted or 0) - count),
        leftovers=tuple(path for path in streams if interrupted and episode_of(path) == saved),
        strays=tuple(path for path in (*streams, *rows) if episode_of(path) is None),
    )


def said_to_be_saved(layout: Layout) -> int:
    """Return how many episodes there should be, by their lines of metadata and by `info.json`."""
    return max(_saved_by_lines(_found(layout, _ROWS)), _saved_in_info(layout) or 0)


def _saved_by_lines(rows: list[Path]) -> int:
    return max((number + 1 for number in map(episode_of, rows) if number is not None), default=0)


def _saved_in_info(layout: Layout) -> int | None:
    """Return how many episodes `info.json` says there are; None if it cannot be read, which no crash does."""
    try:
        return int(read_json(layout.info)["total_episodes"])
    except UNREADABLE:
        return None


def _states(
    layout: Layout, manifest: Manifest, count: int, seal_of: Seals
) -> tuple[tuple[EpisodeState, ...], Totals]:
    states: list[EpisodeState] = []
    totals, start = Totals(), 0
    for number in range(count):
        state = examine(layout, manifest, number, start, seal_of)
        record = state.record
        try:
            totals = totals.grown(record) if record and totals.episodes == number else totals
        except UNREADABLE:
            row = layout.relative(layout.row(number))
            state = replace(state, fault=state.fault or f"the statistics in {row} do not fit the others")
        start = record.start + record.length if record else None
        states.append(replace(state, record=replace(record, stats=None) if record else None))
    return tuple(states), totals


def _found(layout: Layout, pattern: str) -> list[Path]:
    return sorted(layout.root.glob(pattern))


def examine(
    layout: Layout,
    manifest: Manifest,
    number: int,
    start: int | None,
    seal_of: Seals,
) -> EpisodeState:
    """Return the state of one episode.

    Args:
        layout: The dataset, or a folder that holds its files at the same places.
        manifest: The dataset's schema.
        number: Of the episode.
        start: Index of its first frame; None if the episode before does not tell.
        seal_of: Gives the seal of a file.

    Raises:
        HandrailError: Another tool wrote its line of metadata.
    """
    row = layout.row(number)
    try:
        record = read_record(row, with_stats=True)
    except FileNotFoundError:
        return EpisodeState(number, None, f"{layout.relative(row)} is missing")
    except UNREADABLE as error:
        return EpisodeState(number, None, f"{layout.relative(row)} cannot be read ({_first_line(error)})")
    fault = _line_fault(layout, manifest, record, number, start)
    rewritten: dict[str, FileSeal] = {}
    for name, seal in record.files.items():
        if not fault:
            fault = _file_fault(layout.root / name, name, manifest, record, seal, seal_of, rewritten)
    return EpisodeState(number, record, fault, rewritten)


def _first_line(error: BaseException) -> str:
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
        fault = _first_line(error)
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
