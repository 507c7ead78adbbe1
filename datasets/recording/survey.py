"""What lies in the folder of a dataset that Handrail wrote: its episodes, whole or not, and the rest.

A file with the checksum that it had when it was saved is whole. One with another was rewritten, by LeRobot's
`reencode_videos` for instance, or is damaged: it is whole if it still decodes to the episode's frames.
"""

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.layout import Layout, episode_of
from handrail.datasets.format.lines import Lines, count_lines, rows_of_lines
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import EpisodeRecord, FileSeal, Totals
from handrail.datasets.format.schema import video_keys
from handrail.datasets.recording.content import UNREADABLE, content_faults, first_line
from handrail.datasets.storage.strict_json import read_json

Seals = Callable[[Path], FileSeal]
_STREAMS = ("videos/*/*/*.mp4", "data/*/*.parquet")
_GAP = 10_000  # episodes; more that nothing is left of are a name made up


@dataclass(frozen=True)
class EpisodeState:
    """What became of a saved episode.

    Attributes:
        number: Of the episode.
        slot: Of its volume.
        record: Its line of metadata; None if that is missing or cannot be read.
        fault: Why it is not whole, or "".
        rewritten: Files with another checksum that decode to the right frames, with their seals now.
    """

    number: int
    slot: int
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
    """Look at everything, change nothing."""
    rows, found = rows_of_lines(layout), [p for pattern in _STREAMS for p in _found(layout, pattern)]
    within = _within_volumes(rows, found)
    streams = [path for path in found if path not in within]
    saved, counted = _saved_by_lines(rows), _saved_in_info(layout)
    beyond = {number for number in map(episode_of, streams) if number is not None and number >= saved}
    interrupted = beyond == {saved} and counted is not None and counted <= saved  # a crash: the next one's
    count = saved if interrupted or not beyond else max(beyond) + 1
    slots = {number for number in map(episode_of, (*rows, *streams)) if number is not None and number < count}
    if count > 10 * len(slots) + _GAP and count > 10 * sum(map(count_lines, rows)) + _GAP:
        raise HandrailError(
            f"dataset {str(layout.root)!r}: a file says that it is of episode {count - 1}, with next to none"
            " before it; move it away"
        )
    states, totals = _states(layout, manifest, sorted(slots), count, seal_of)
    return Survey(
        states,
        totals,
        absent=max(0, (counted or 0) - count),
        leftovers=tuple(path for path in streams if interrupted and episode_of(path) == saved),
        strays=tuple(path for path in (*found, *rows) if episode_of(path) is None or path in within),
    )


def _within_volumes(rows: list[Path], streams: list[Path]) -> set[Path]:
    """Return the files named after an episode that is in the files of another: they are of no volume."""
    slots = {number: path for path in rows if (number := episode_of(path)) is not None}
    begins = sorted(slots)
    found: set[Path] = set()
    for path in streams:
        number = episode_of(path)
        if number is None or number in slots or not begins or number < begins[0]:
            continue
        begin = begins[bisect_right(begins, number) - 1]
        if number < begin + count_lines(slots[begin]):
            found.add(path)
    return found


def said_to_be_saved(layout: Layout) -> int:
    """Return how many episodes there should be, by their lines of metadata and by `info.json`."""
    return max(_saved_by_lines(rows_of_lines(layout)), _saved_in_info(layout) or 0)


def _saved_by_lines(rows: list[Path]) -> int:
    slots = {number: path for path in rows if (number := episode_of(path)) is not None}
    return max(slots) + count_lines(slots[max(slots)]) if slots else 0


def _saved_in_info(layout: Layout) -> int | None:
    """Return how many episodes `info.json` says there are; None if it cannot be read, which no crash does."""
    try:
        return int(read_json(layout.info)["total_episodes"])
    except UNREADABLE:
        return None


def _states(
    layout: Layout, manifest: Manifest, slots: list[int], count: int, seal_of: Seals
) -> tuple[tuple[EpisodeState, ...], Totals]:
    """Return the states of all episodes, volume by volume, and what those before the first gap add up to."""
    states: list[EpisodeState] = []
    totals, start = Totals(), 0
    for slot, after in pairwise([*slots, count]):
        while len(states) < slot:
            states.append(_missing(layout, len(states)))
            start = None
        found, lines = examine(layout, manifest, slot, start, seal_of)
        found = found[: after - slot]
        try:
            totals = _grown(totals, lines) if lines and totals.episodes == slot else totals
        except UNREADABLE:
            row = layout.relative(layout.row(slot))
            fault = f"the statistics in {row} do not fit the others"
            found = tuple(replace(state, fault=state.fault or fault) for state in found)
        last = found[-1].record
        start = last.start + last.length if last else None
        states += found
    states += [_missing(layout, number) for number in range(len(states), count)]
    return tuple(states), totals


def _grown(totals: Totals, lines: Lines) -> Totals:
    """Return the totals with the episodes of one more volume, as the volume says or one by one."""
    if lines.totals is not None and lines.totals.episodes == totals.episodes + len(lines):
        return lines.totals
    for record in lines.records(with_stats=True):
        totals = totals.grown(record)
    return totals


def _missing(layout: Layout, number: int) -> EpisodeState:
    return EpisodeState(number, number, None, f"{layout.relative(layout.row(number))} is missing")


def _found(layout: Layout, pattern: str) -> list[Path]:
    return sorted(layout.root.glob(pattern))


def examine(
    layout: Layout,
    manifest: Manifest,
    slot: int,
    start: int | None,
    seal_of: Seals,
) -> tuple[tuple[EpisodeState, ...], Lines | None]:
    """Return the states of the episodes of one volume, one at least, and their lines if these can be read.

    Args:
        layout: The dataset, or a folder that holds its files at the same places.
        manifest: The dataset's schema.
        slot: Of the volume.
        start: Index of its first frame; None if the episode before does not tell.
        seal_of: Gives the seal of a file.
    """
    row = layout.row(slot)
    try:
        lines = Lines.read(row)
        records = list(lines.records())
    except FileNotFoundError:
        return (_missing(layout, slot),), None
    except UNREADABLE as error:
        fault = f"{layout.relative(row)} cannot be read ({first_line(error)})"
        return (EpisodeState(slot, slot, None, fault),), None
    faults = _line_faults(layout, manifest, records, slot, start)
    rewritten: dict[str, FileSeal] = {}
    for name, seal in lines.files.items():
        if not all(faults):
            found = _file_faults(layout.root / name, name, manifest, lines, seal, seal_of, rewritten)
            faults = [fault or more for fault, more in zip(faults, found, strict=True)]
    states = (
        EpisodeState(slot + place, slot, record, fault, rewritten)
        for place, (record, fault) in enumerate(zip(records, faults, strict=True))
    )
    return tuple(states), lines


def _line_faults(
    layout: Layout, manifest: Manifest, records: list[EpisodeRecord], slot: int, start: int | None
) -> list[str]:
    """Return what is wrong with each line, or ""."""
    row, faults = layout.relative(layout.row(slot)), []
    expected = {layout.data(slot), *(layout.video(key, slot) for key in video_keys(manifest.features))}
    named = {layout.root / name for name in records[0].files} == expected
    start = records[0].start if start is None else start
    for number, record in enumerate(records, slot):
        fault = "" if named else f"{row} names files that are not those of episode {slot}"
        if (record.episode, record.start, record.slot) != (number, start, slot) or record.length < 1:
            fault = f"{row} is not the line of episode {number}, frame {start} on"
        faults.append(fault)
        start = record.start + record.length
    return faults


def _file_faults(
    path: Path,
    name: str,
    manifest: Manifest,
    lines: Lines,
    seal: FileSeal,
    seal_of: Seals,
    rewritten: dict[str, FileSeal],
) -> list[str]:
    """Return what is wrong with each episode in a file, or ""; whole files are added to `rewritten`."""
    size = ""
    try:
        found = seal_of(path)
        if found == seal:
            return [""] * len(lines)
        size = f"has {found.size} bytes, expected {seal.size}" if found.size != seal.size else ""
    except OSError as error:
        missing = isinstance(error, FileNotFoundError)
        return [f"{name} is missing" if missing else f"{name} ({first_line(error)})"] * len(lines)
    faults = content_faults(path, name, manifest, lines)
    if not any(faults):
        rewritten[name] = found
    return [f"{name} {size or 'has other content'} ({fault})" if fault else "" for fault in faults]
