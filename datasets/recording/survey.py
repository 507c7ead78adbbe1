"""What lies in the folder of a dataset that Handrail wrote: its episodes, and what belongs to none."""

from dataclasses import dataclass, replace
from pathlib import Path

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.layout import Layout, episode_of
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import Totals
from handrail.datasets.recording.wholeness import UNREADABLE, EpisodeState, Seals, examine
from handrail.datasets.storage.strict_json import read_json

_STREAMS = ("videos/*/*/*.mp4", "data/*/*.parquet")
_GAP = 10_000  # episodes; more that nothing is left of are a name made up
_ROWS = "meta/episodes/*/*.parquet"


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
