"""Editing datasets that Handrail recorded: every column and every episode's metadata stays.

A new dataset is written from episodes of old ones, in one pass; it has its name only when it is whole.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa

from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.errors import HandrailError, unknown_name
from handrail.datasets.editing.config import (
    DeleteConfig,
    EditConfig,
    KeepConfig,
    RelabelConfig,
    RenameConfig,
    SplitConfig,
    TrimConfig,
)
from handrail.datasets.editing.pack import Edited, check_free, taken
from handrail.datasets.editing.source import EditSource
from handrail.datasets.format.data_file import data_files
from handrail.datasets.format.metadata import ColumnTypes
from handrail.datasets.format.video import GROUP
from handrail.datasets.quality.motion import FLOOR
from handrail.datasets.reading.demonstration import Demonstration
from handrail.datasets.reading.reader import read_rows_of
from handrail.datasets.recording.rewrite import drafted, write_anew
from handrail.datasets.recording.slice import TRIMMED, EpisodeSlice
from handrail.datasets.storage.atomic import explained

_LABELS = {"success": pa.bool_(), "failure_reason": pa.string()}


_SHARE = 0.01  # of an entry's range in the episode
STATE, SUCCESS = "observation.state", "next.success"


_RANGE = re.compile(r"(\d{1,9})(?:-(\d{1,9}))?")
_WORDS = {"failed": False, "succeeded": True}
_ROUNDING = 1e-9


def chosen_episodes(flag: str, words: Sequence[str], successes: Sequence[bool | None]) -> list[int]:
    """Return the episodes that are meant, in order, each once.

    Args:
        flag: That the words are of, for the error.
        words: Numbers, ranges, `failed` or `succeeded`.
        successes: Of every episode of the dataset; None where that is not known.
    """
    found: set[int] = set()
    for word in words:
        match = _RANGE.fullmatch(word)
        if word in _WORDS:
            found |= {number for number, success in enumerate(successes) if success is _WORDS[word]}
        elif match:
            first, last = int(match[1]), int(match[2] or match[1])
            if not first <= last < len(successes):
                raise HandrailError(f"{flag} {word}: expected episodes from 0 to {len(successes) - 1}")
            found |= set(range(first, last + 1))
        else:
            raise HandrailError(f"{flag} {word}: expected a number, a range such as 0-4, failed or succeeded")
    return sorted(found)


def split_parts(words: Sequence[str], successes: Sequence[bool | None]) -> Mapping[str, list[int]]:
    """Return the episodes of each part.

    Args:
        words: `NAME=SHARE` each, or `NAME=EPISODE` with more episodes after it.
        successes: As for `chosen_episodes`.
    """
    given = _by_name(words)
    shares = {name: float(said[0]) for name, said in given.items() if _is_share(said)}
    if shares and len(shares) < len(given):
        raise HandrailError("--parts: expected shares or episodes for all of them, got both")
    parts = _shared(shares, len(successes)) if shares else {}
    for name, said in given.items():
        if not shares:
            parts[name] = chosen_episodes(f"--parts {name}", said, successes)
        if not parts[name]:
            raise HandrailError(f"--parts {name}: expected an episode or more of {len(successes)}, got none")
    everything = [number for numbers in parts.values() for number in numbers]
    twice = next((number for number in everything if everything.count(number) > 1), None)
    if twice is not None:
        raise HandrailError(f"--parts: expected each episode in one part, got episode {twice} in two")
    return parts


def _by_name(words: Sequence[str]) -> dict[str, list[str]]:
    given: dict[str, list[str]] = {}
    name = ""
    for word in words:
        before, equals, after = word.rpartition("=")
        if equals:
            name = before
            if not re.fullmatch(r"\w[\w.-]*", name) or name in given:
                raise HandrailError(
                    f"--parts {word}: expected a name of its own, as in {name or 'train'}=0.8"
                )
            given[name] = [after]
        elif name:
            given[name].append(word)
        else:
            raise HandrailError(f"--parts {word}: expected NAME=SHARE or NAME=EPISODES")
    return given


def _is_share(said: Sequence[str]) -> bool:
    return len(said) == 1 and re.fullmatch(r"[01]?\.\d{1,9}|1\.", said[0]) is not None


def _shared(shares: Mapping[str, float], count: int) -> dict[str, list[int]]:
    """Return the episodes of each part, one part after the other."""
    if sum(shares.values()) > 1.0 + _ROUNDING:
        raise HandrailError(f"--parts: expected shares up to 1 together, got {sum(shares.values()):g}")
    parts, total = {}, 0.0
    for name, share in shares.items():
        begin, total = round(total * count), total + share
        parts[name] = list(range(begin, round(total * count)))
    return parts


def moving_stretch(episode: Demonstration, margin: float) -> tuple[int, int]:
    """Return the first frame and the number of frames between what is idle at both ends.

    A frame is idle while |q(t) − q(end)| ≤ max(0.005, 1 % of the range) for every entry of the
    configuration q, where the end is that of its side. The first frame with success is never cut off. Where
    there are cameras, the first frame begins a group of pictures, so that videos need not be encoded anew.

    Args:
        episode: Which; its configuration in the units of its state.
        margin: Time to leave on both sides [s].
    """
    positions, count = episode.configuration, episode.count
    moved = np.flatnonzero(_away(positions, positions[0]))
    if not moved.size:
        return 0, count
    spare = round(margin * episode.fps)
    first = max(0, int(moved[0]) - spare)
    last = int(np.flatnonzero(_away(positions, positions[-1]))[-1]) + 1
    end = max(min(count, last + 1 + spare), _succeeded(episode))
    pictured = any(feature.is_video for feature in episode.info.features.values())
    first -= first % GROUP if pictured else 0
    return first, end - first


def _away(positions: FloatArray, place: FloatArray) -> BoolArray:
    """Return at which frames anything is elsewhere, (N,)."""
    still = np.maximum(FLOOR, _SHARE * np.ptp(positions, axis=0))
    return (np.abs(positions - place) > still).any(axis=1)


def _succeeded(episode: Demonstration) -> int:
    """Return how many frames there are up to the first with success; 0 without one."""
    if SUCCESS not in episode.frames:
        return 0
    done = np.flatnonzero(episode.frames[SUCCESS])
    return int(done[0]) + 1 if done.size else 0


def edit(config: EditConfig) -> list[Edited]:
    """Do what a config says and return the datasets that were written."""
    config.check()
    with explained(f"{config.verb}: cannot write {str(config.target)!r}"):
        if config.in_place:
            with taken(config.target, config.verify) as source:
                return [_write(config, config.target, source, _pieces(config, source))]
        check_free(config.target)
        source = EditSource.open(config.root, config.verify)
        if isinstance(config, SplitConfig):
            return _split(config, source)
        return [_write(config, config.target, source, _pieces(config, source))]


def _split(config: SplitConfig, source: EditSource) -> list[Edited]:
    """Write the parts, which are there all together or none of them."""
    with drafted(config.target) as draft:
        edited = [
            _write(config, draft.root / name, source, source.slices(numbers), f"_{name}")
            for name, numbers in split_parts(config.parts, source.successes).items()
        ]
    return [replace(each, root=config.target / each.root.name) for each in edited]


def _write(
    config: EditConfig, root: Path, source: EditSource, pieces: Iterable[EpisodeSlice], suffix: str = ""
) -> Edited:
    manifest = replace(source.manifest, repo_id=(config.name or source.manifest.repo_id) + suffix)
    manifest.check()
    types: ColumnTypes = source.types
    if isinstance(config, RelabelConfig):
        types = {**_LABELS, **types}
    if isinstance(config, TrimConfig):
        types = {**types, TRIMMED: pa.int64()}
    totals = write_anew(root, manifest, pieces, types, source.encodings, config.in_place)
    return Edited(root, totals.episodes, totals.frames, source.info.frames)


def _pieces(config: EditConfig, source: EditSource) -> Iterator[EpisodeSlice]:
    """Yield what one dataset's episodes become."""
    everything = range(len(source.rows))
    words: Sequence[str] = getattr(config, "episodes", ())
    chosen = set(chosen_episodes("--episodes", words, source.successes))
    if isinstance(config, DeleteConfig):
        return source.slices([each for each in everything if each not in chosen])
    if isinstance(config, KeepConfig):
        return source.slices(sorted(chosen))
    if isinstance(config, RenameConfig) and config.old_task and config.old_task not in source.tasks:
        raise unknown_name("task", config.old_task, source.tasks)
    touched = chosen if words else set(everything)
    return (
        _changed(config, source, piece) if piece.record.episode in touched else piece
        for piece in source.slices()
    )


def _changed(config: EditConfig, source: EditSource, piece: EpisodeSlice) -> EpisodeSlice:
    if isinstance(config, TrimConfig):
        return _trimmed(config, source, piece)
    if isinstance(config, RelabelConfig):
        success = config.label == "success"
        said = piece.saying(success=success, failure_reason="" if success else config.reason or "relabelled")
        return replace(said, success=success)
    assert isinstance(config, RenameConfig)
    old = {task for task in piece.record.tasks if not config.old_task or task == config.old_task}
    return replace(piece, sentences=dict.fromkeys(old, config.task))


def _trimmed(config: TrimConfig, source: EditSource, piece: EpisodeSlice) -> EpisodeSlice:
    number = piece.record.episode
    columns = [name for name in (STATE, SUCCESS) if name in source.info.features]
    with data_files() as files:
        frames = read_rows_of(source.info, source.rows[number], columns, files)
    episode = Demonstration(number, source.info, frames, source.rows[number])
    first, length = moving_stretch(episode, config.margin)
    before = piece.columns.get(TRIMMED) or 0
    return replace(piece, first=first, length=length).saying(**{TRIMMED: int(before) + first})
