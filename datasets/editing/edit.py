"""Editing datasets that Handrail recorded: every column and every episode's metadata stays.

A new dataset is written from episodes of old ones, in one pass; it has its name only when it is whole.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import pyarrow as pa

from handrail.controllers.errors import unknown_name
from handrail.datasets.demonstrations.demonstration import Demonstration
from handrail.datasets.editing.config import EditConfig
from handrail.datasets.editing.idle import STATE, SUCCESS, moving_stretch
from handrail.datasets.editing.pack import Edited, check_free, merge_datasets, taken
from handrail.datasets.editing.selection import chosen_episodes, split_parts
from handrail.datasets.editing.source import Source
from handrail.datasets.format.columns import ColumnTypes
from handrail.datasets.reading.reader import read_rows_of
from handrail.datasets.recording.piece import TRIMMED, Piece
from handrail.datasets.recording.rewrite import drafted, write_anew
from handrail.datasets.storage.atomic import explained

_LABELS = {"success": pa.bool_(), "failure_reason": pa.string()}


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
    with taken(config.target, config.verify) as source:
        return _write(config, config.target, source, _pieces(config, source))


def _anew(config: EditConfig) -> list[Edited]:
    if config.verb == "merge":
        return [merge_datasets(config.roots, config.target, config.name, config.verify)]
    check_free(config.target)
    source = Source.open(config.roots[0], config.verify)
    if config.verb == "split":
        return _split(config, source)
    return [_write(config, config.target, source, _pieces(config, source))]


def _split(config: EditConfig, source: Source) -> list[Edited]:
    """Write the parts, which are there all together or none of them."""
    with drafted(config.target) as draft:
        edited = [
            _write(config, draft.root / name, source, source.pieces(numbers), f"_{name}")
            for name, numbers in split_parts(config.parts, source.successes).items()
        ]
    return [replace(each, root=config.target / each.root.name) for each in edited]


def _write(
    config: EditConfig, root: Path, source: Source, pieces: Iterable[Piece], suffix: str = ""
) -> Edited:
    manifest = source.manifest.named((config.name or source.manifest.repo_id) + suffix)
    manifest.check()
    types = _types(config, source)
    totals = write_anew(root, manifest, pieces, types, source.encodings, config.in_place)
    return Edited(root, totals.episodes, totals.frames, source.info.frames)


def _types(config: EditConfig, source: Source) -> ColumnTypes:
    if config.verb == "relabel":
        return {**_LABELS, **source.types}
    return {**source.types, **({TRIMMED: pa.int64()} if config.verb == "trim" else {})}


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
