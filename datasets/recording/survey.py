"""The content of the folder of a dataset that Handrail wrote: its episodes, whole or not, and the rest.

A file with the checksum that it had when it was saved is whole. One with another was rewritten, by LeRobot's
`reencode_videos` for instance, or is damaged: it is whole if it still decodes to the episode's frames.
"""

import shlex
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

from handrail.controllers.errors import HandrailError, first_line
from handrail.datasets.format.episode_rows import EpisodeRows, count_rows, row_files
from handrail.datasets.format.layout import Layout, episode_of
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import Checksum, EpisodeRecord, Totals
from handrail.datasets.format.schema import video_keys
from handrail.datasets.format.tables import UNREADABLE
from handrail.datasets.recording.checksums import Checksums
from handrail.datasets.recording.content import content_faults
from handrail.datasets.storage.strict_json import read_json

_SHOWN = 3  # faults in one line
_GAP = 10_000  # episodes; more that nothing is left of are a number made up


@dataclass(frozen=True)
class GroupState:
    """The state of the episodes that share their files."""

    first: int
    """Number of the first episode."""
    faults: Sequence[str]
    """Why an episode is not whole, or "", one an episode."""
    rewritten: dict[str, Checksum] = field(default_factory=dict)
    """Files with another checksum that decode to the right frames, with their checksums now."""


@dataclass(frozen=True)
class Survey:
    """The findings; `check` and `repair` read it."""

    layout: Layout
    groups: Sequence[GroupState]
    totals: Totals
    """The totals of the episodes before the first one without a row of metadata."""
    leftovers: tuple[Path, ...]
    """Files of the one episode that a crash cut short before it was saved."""
    unknown: tuple[Path, ...]
    """Files with names that no episode has; LeRobot would read them."""

    @property
    def episodes(self) -> int:
        """Number of saved episodes, whole or not."""
        return sum(len(group.faults) for group in self.groups)

    @property
    def damage(self) -> tuple[str, ...]:
        """The faults, one text an episode."""
        faults = [each for group in self.groups for each in enumerate(group.faults, group.first)]
        return tuple(f"episode {number}: {fault}" for number, fault in faults if fault)

    @property
    def rewritten(self) -> tuple[str, ...]:
        """Files of whole episodes that another tool wrote anew."""
        return tuple(name for group in self.groups if not all(group.faults) for name in group.rewritten)

    def require_whole(self) -> None:
        """Check that no episode is damaged, nor its rows written by another tool."""
        root, repair = self.layout.root, f"handrail-edit repair {shlex.quote(str(self.layout.root))}"
        if self.damage:
            what = "was copied in part" if all("missing" in each for each in self.damage) else "is damaged"
            raise HandrailError(
                f"dataset {str(root)!r} {what}: {len(self.damage)} of {self.episodes} episodes are not whole"
                f" ({shortened(self.damage)}); nothing has been changed; copy it again, see what {repair} can"
                " mend, or go on without them with its --set_aside"
            )
        if anew := [name for name in self.rewritten if name.startswith("data/")]:
            raise HandrailError(
                f"dataset {str(root)!r}: another tool wrote {shortened(anew, ', ')} anew; if the rows are"
                f" right, {repair} takes them as they are"
            )


def shortened(texts: Sequence[str], comma: str = "; ") -> str:
    """Return the first few of many texts, and how many more there are."""
    more = f" and {len(texts) - _SHOWN} more" if len(texts) > _SHOWN else ""
    return comma.join(texts[:_SHOWN]) + more


def survey(layout: Layout, manifest: Manifest, sums: Checksums) -> Survey:
    """Look at everything, change nothing; remember the checksums."""
    rows = row_files(layout)
    folders = [layout.root / "videos" / key for key in video_keys(manifest.features)]
    videos = [path for folder in folders for path in folder.glob("*/*.mp4")]
    streams = sorted((*videos, *layout.root.glob("data/*/*.parquet")))
    heads = _heads({number: path for path in rows if (number := episode_of(path)) is not None})
    groups = list(heads.values())
    numbered = {path: number for path in streams if (number := episode_of(path)) is not None}
    saved, counted = groups[-1].stop if groups else 0, _saved_in_info(layout)
    inside = _inside(numbered, groups) | (set(rows) - heads.keys())
    begun = {number for path, number in numbered.items() if path not in inside}
    beyond = {number for number in begun if number >= saved}
    interrupted = beyond == {saved} and counted is not None and counted <= saved  # a crash: the next one's
    firsts = sorted({each.start for each in groups} | (begun - {saved} if interrupted else begun))
    count = max(saved, counted or 0, firsts[-1] + 1 if firsts else 0)
    if count > 10 * len(firsts) + _GAP and count > 10 * sum(map(len, groups)) + _GAP:
        raise HandrailError(
            f"dataset {str(layout.root)!r}: meta/info.json or the name of a file says that there are {count}"
            " episodes, of which next to none are there; move it away"
        )
    states, totals = _states(layout, manifest, firsts, count, sums)
    sums.remember()
    leftovers = tuple(path for path, number in numbered.items() if interrupted and number == saved)
    unknown = tuple(path for path in (*streams, *rows) if episode_of(path) is None or path in inside)
    return Survey(layout, states, totals, leftovers, unknown)


def _heads(rows: Mapping[int, Path]) -> dict[Path, range]:
    """Return the files of episode rows with their episodes, but for those that are in the one before."""
    heads, end = dict[Path, range](), 0
    for number, path in sorted(rows.items()):
        if number >= end:
            end = number + count_rows(path)
            heads[path] = range(number, end)
    return heads


def _inside(numbered: Mapping[Path, int], groups: Sequence[range]) -> set[Path]:
    """Return the files named after an episode that is in the files of another: they are of no group."""
    firsts = [each.start for each in groups]
    places = {path: bisect_right(firsts, number) - 1 for path, number in numbered.items()}
    return {path for path, place in places.items() if place >= 0 and numbered[path] in groups[place][1:]}


def _saved_in_info(layout: Layout) -> int | None:
    """Return how many episodes `info.json` says there are; None if it cannot be read, which no crash does."""
    try:
        return int(read_json(layout.info)["total_episodes"])
    except UNREADABLE:
        return None


def _states(
    layout: Layout, manifest: Manifest, firsts: Sequence[int], count: int, sums: Checksums
) -> tuple[list[GroupState], Totals]:
    """Return the states of all file groups and gaps, and what the episodes before the first gap add up to."""
    found: list[GroupState] = []
    totals, start, number = Totals(), 0, 0
    for first, after in pairwise([*firsts, count]):
        if number < first:
            found.append(_missing(layout, number, first))
            start = None
        state, rows = _examined(layout, manifest, first, start, sums)
        if rows and totals.episodes == first:
            try:
                totals = _grown(totals, rows)
            except UNREADABLE:
                fault = f"the statistics in {layout.relative(rows.path)} do not fit the others"
                state = replace(state, faults=[each or fault for each in state.faults])
        state = replace(state, faults=state.faults[: after - first])
        found.append(state)
        number = first + len(state.faults)
        last = rows.record(number - first - 1) if rows else None
        start = last.start + last.length if last else None
    if number < count:
        found.append(_missing(layout, number, count))
    return found, totals


def _missing(layout: Layout, first: int, end: int) -> GroupState:
    rows = [layout.row(number) for number in range(first, end)]
    return GroupState(first, [f"{layout.relative(row)} is missing" for row in rows])


def _grown(totals: Totals, rows: EpisodeRows) -> Totals:
    """Return the totals with the episodes of one more group, as its file says or one by one."""
    if rows.totals is not None and rows.totals.episodes == totals.episodes + len(rows):
        return rows.totals
    for record in rows.records(with_stats=True):
        totals = totals.grown(record)
    return totals


def _examined(
    layout: Layout, manifest: Manifest, first: int, start: int | None, sums: Checksums
) -> tuple[GroupState, EpisodeRows | None]:
    """Return the state of a file group, and its episode rows if these can be read.

    Args:
        layout: The dataset.
        manifest: Its schema.
        first: The first episode.
        start: Index of its first frame; None if the episode before does not tell.
        sums: Gives the checksum of a file.
    """
    row = layout.row(first)
    try:
        rows = EpisodeRows.read(row)
        records = list(rows.records())
    except FileNotFoundError:
        return _missing(layout, first, first + 1), None
    except UNREADABLE as error:
        return GroupState(first, [f"{layout.relative(row)} cannot be read ({first_line(error)})"]), None
    faults = _row_faults(layout, manifest, records, first, start)
    rewritten: dict[str, Checksum] = {}
    for name, saved in rows.files.items():
        if not all(faults):
            found = _file_faults(layout.root / name, name, manifest, rows, saved, sums)
            if isinstance(found, Checksum):
                rewritten[name] = found
            else:
                faults = [fault or more for fault, more in zip(faults, found, strict=True)]
    return GroupState(first, faults, rewritten), rows


def _row_faults(
    layout: Layout, manifest: Manifest, records: Sequence[EpisodeRecord], first: int, start: int | None
) -> list[str]:
    """Return what is wrong with each row of metadata, or ""."""
    row, faults = layout.relative(layout.row(first)), []
    expected = {layout.data(first), *(layout.video(key, first) for key in video_keys(manifest.features))}
    named = {layout.root / name for name in records[0].files} == expected
    start = records[0].start if start is None else start
    for number, record in enumerate(records, first):
        fault = "" if named else f"{row} names files that are not those of episode {first}"
        if (record.episode, record.start, record.file_index) != (number, start, first) or record.length < 1:
            fault = f"{row} is not the row of episode {number}, frame {start} on"
        faults.append(fault)
        start = record.start + record.length
    return faults


def _file_faults(
    path: Path, name: str, manifest: Manifest, rows: EpisodeRows, saved: Checksum, sums: Checksums
) -> Sequence[str] | Checksum:
    """Return the faults of the episodes in a file, or its checksum if it was rewritten and is whole."""
    try:
        found = sums.of(path)
    except FileNotFoundError:
        return [f"{name} is missing"] * len(rows)
    except OSError as error:
        return [f"{name} ({first_line(error)})"] * len(rows)
    if found == saved:
        return [""] * len(rows)
    same_size = found.size == saved.size
    decayed = same_size and name.startswith("videos/")  # one that is encoded anew has another size
    faults = ["bits have changed"] * len(rows) if decayed else content_faults(path, name, manifest, rows)
    if not any(faults):
        return found
    other = "has other content" if same_size else f"has {found.size} bytes, expected {saved.size}"
    return [f"{name} {other} ({fault})" if fault else "" for fault in faults]
