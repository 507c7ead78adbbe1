"""Editing datasets that Handrail recorded: every column and every episode's metadata stays.

A new dataset is written from episodes of old ones, in one pass; it has its name only when it is whole.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import pyarrow as pa

from handrail.controllers.errors import HandrailError, unknown_name
from handrail.datasets.editing.config import EditConfig
from handrail.datasets.editing.idle import STATE, SUCCESS, moving_stretch
from handrail.datasets.editing.merge import check_alike, merged_encodings, merged_types
from handrail.datasets.editing.selection import chosen_episodes, split_parts
from handrail.datasets.editing.source import Source
from handrail.datasets.format.columns import ColumnTypes
from handrail.datasets.quality.demonstration import Demonstration
from handrail.datasets.reading.reader import read_rows_of
from handrail.datasets.recording.checksums import Checksums
from handrail.datasets.recording.drop import check_nothing_set_aside
from handrail.datasets.recording.piece import TRIMMED, Piece
from handrail.datasets.recording.repair import tidy_locked
from handrail.datasets.recording.rewrite import settle, write_anew
from handrail.datasets.storage.atomic import explained
from handrail.datasets.storage.lock import DatasetLock

_LABELS = {"success": pa.bool_(), "failure_reason": pa.string()}


@dataclass(frozen=True)
class Edited:
    """A dataset that was written.

    Attributes:
        root: Its folder.
        episodes: Number of episodes.
        frames: Number of frames.
        before: Number of frames of the datasets that it came from.
    """

    root: Path
    episodes: int
    frames: int
    before: int

    def __str__(self) -> str:
        return f"{self.root}: {self.episodes} episodes, {self.frames} frames (of {self.before})"


def edit(config: EditConfig) -> list[Edited]:
    """Do what a config says and return the datasets that were written.

    Raises:
        HandrailError: A setting or a dataset is wrong, or the disk does not take it. Nothing has been changed
            then.
    """
    config.check()
    with explained(f"{config.verb}: cannot write {str(config.target)!r}"):
        return [_in_place(config)] if config.in_place else _anew(config)


def _in_place(config: EditConfig) -> Edited:
    root = config.target
    if settle(root):
        raise HandrailError(
            f"dataset {str(root)!r}: an edit was cut short, and is finished now; look at it (handrail-inspect"
            f" {root}) before the next"
        )
    source = Source.open(root)
    check_nothing_set_aside(source.layout)
    lock = DatasetLock(source.layout.staging)
    try:
        tidy_locked(source.layout, source.manifest, Checksums(root, anew=config.verify))
        return _write(config, root, [source], _pieces(config, source))
    finally:
        lock.release()


def _anew(config: EditConfig) -> list[Edited]:
    _check_free(config)
    sources = [Source.open(root, config.verify) for root in config.roots]
    for other in sources[1:]:
        check_alike(sources[0], other)
    if config.verb == "merge":
        everything = chain.from_iterable(source.pieces() for source in sources)
        return [_write(config, config.target, sources, everything)]
    if config.verb == "split":
        parts = split_parts(config.parts, sources[0].successes)
        return [
            _write(config, config.target / name, sources, sources[0].pieces(numbers), f"_{name}")
            for name, numbers in parts.items()
        ]
    return [_write(config, config.target, sources, _pieces(config, sources[0]))]


def _write(
    config: EditConfig, root: Path, sources: Sequence[Source], pieces: Iterable[Piece], suffix: str = ""
) -> Edited:
    manifest = sources[0].manifest.named((config.name or sources[0].manifest.repo_id) + suffix)
    manifest.check()
    types = _types(config, sources)
    totals = write_anew(root, manifest, pieces, types, merged_encodings(sources), config.in_place)
    return Edited(root, totals.episodes, totals.frames, sum(source.info.frames for source in sources))


def _types(config: EditConfig, sources: Sequence[Source]) -> ColumnTypes:
    new = {"trim": {TRIMMED: pa.int64()}, "relabel": _LABELS}.get(config.verb, {})
    return {**new, **merged_types(sources)} if config.verb == "relabel" else merged_types(sources) | new


def _pieces(config: EditConfig, source: Source) -> Iterator[Piece]:
    """Yield what one dataset's episodes become."""
    count = len(source.rows)
    chosen = chosen_episodes("--episodes", config.episodes, source.successes)
    if config.verb in ("delete", "keep"):
        kept = [each for each in range(count) if (each in set(chosen)) == (config.verb == "keep")]
        return source.pieces(kept)
    if config.old_task and config.old_task not in source.tasks:
        raise unknown_name("task", config.old_task, source.tasks)
    touched = set(chosen if config.episodes else range(count))
    change = {"trim": _trimmed, "relabel": _relabelled, "rename": _renamed}[config.verb]
    return (
        change(config, source, piece) if piece.record.episode in touched else piece
        for piece in source.pieces()
    )


def _trimmed(config: EditConfig, source: Source, piece: Piece) -> Piece:
    number = piece.record.episode
    columns = [name for name in (STATE, SUCCESS) if name in source.info.features]
    frames = read_rows_of(source.info, source.rows[number], columns)
    episode = Demonstration(number, source.info, frames, source.rows[number])
    first, length = moving_stretch(episode, config.margin)
    before = piece.columns.get(TRIMMED) or 0
    return piece.stretch(first, length).saying(**{TRIMMED: int(before) + first})


def _relabelled(config: EditConfig, source: Source, piece: Piece) -> Piece:
    success = config.label == "success"
    said = piece.saying(success=success, failure_reason="" if success else config.reason or "relabelled")
    return said.ending(success)


def _renamed(config: EditConfig, source: Source, piece: Piece) -> Piece:
    old = piece.record.tasks
    known = {task for task in old if not config.old_task or task == config.old_task}
    return piece.renamed(dict.fromkeys(known, config.task))


def _check_free(config: EditConfig) -> None:
    """Check that nothing lies where a dataset is to be written."""
    target = config.target
    if target.exists() and (not target.is_dir() or any(target.iterdir())):
        raise HandrailError(f"--output {config.output}: expected a missing or empty folder, found one in use")
