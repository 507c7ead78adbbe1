"""Putting back what lies in `.damaged/`: files where they were, whole episodes at the dataset's end.

An episode that is put back gets the next number, and a mark of the line that it had: cut short at any moment,
this is done again without an episode coming twice. What was set aside is removed only after it is back.
"""

import hashlib
from pathlib import Path

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.layout import Layout, episode_of
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import (
    EpisodeRecord,
    FileSeal,
    Totals,
    read_column_types,
    read_origin,
    read_record,
)
from handrail.datasets.recording.append import append_episode
from handrail.datasets.recording.piece import Piece
from handrail.datasets.recording.survey import UNREADABLE, EpisodeState, examine
from handrail.datasets.storage.atomic import move, remove, sync_folder


def folders(layout: Layout) -> list[Layout]:
    """Return the folders below `.damaged/`, the newest first; each holds files as a dataset does."""
    found = layout.damaged.iterdir() if layout.damaged.is_dir() else ()
    return [Layout(path) for path in sorted(found, reverse=True) if path.is_dir()]


def restore(layout: Layout, counted: int) -> list[str]:
    """Undo a setting aside that was cut short: move files back to where their episode's line expects them.

    Args:
        layout: The dataset.
        counted: How many episodes it should have.

    Returns:
        The paths in the dataset of what was moved back.
    """
    restored: list[str] = []
    start = 0
    for number in range(counted if folders(layout) else 0):
        row = layout.row(number)
        place = row if row.exists() else _line_set_aside(layout, number, start)
        record = None if place is None else _readable(place)
        if place is None or record is None:
            break
        start = record.start + record.length
        for name, seal in record.files.items():
            if not (layout.root / name).exists() and (source := _set_aside(layout, name, seal)):
                move(source, layout.root / name)
                restored.append(name)
        if place != row:
            move(place, row)
            restored.append(layout.relative(row))
    return restored


def put_back(layout: Layout, manifest: Manifest, totals: Totals) -> tuple[Totals, int]:
    """Append every whole episode of `.damaged/` that fits the dataset.

    Args:
        layout: The dataset; all of its episodes are whole.
        manifest: Its schema.
        totals: What its episodes add up to.

    Returns:
        What they add up to then, and how many were put back.
    """
    before = totals.episodes
    known = {read_origin(layout.row(number)) for number in range(totals.episodes)}
    for folder in folders(layout):
        for row in sorted(folder.root.glob("meta/episodes/*/*.parquet")):
            state = _candidate(folder, manifest, row)
            if state is None:
                continue
            origin = hashlib.sha256(row.read_bytes()).hexdigest()
            if origin not in known:
                try:
                    assert state.record is not None
                    last = layout.row(totals.episodes - 1) if totals.episodes else row
                    piece, types = Piece.of(folder, manifest, state.record), read_column_types(last)
                    totals = totals.grown(append_episode(layout, manifest, piece, types, totals, origin))
                except (HandrailError, ValueError):
                    continue  # columns that this dataset does not have, or tasks that do not add up
                known.add(origin)
            _forget(folder, row, state)
    _remove_empty(layout.damaged)
    return totals, totals.episodes - before


def _candidate(folder: Layout, manifest: Manifest, row: Path) -> EpisodeState | None:
    """Return an episode that was set aside, if it is whole."""
    number = episode_of(row)
    if number is None:
        return None
    try:
        state = examine(folder, manifest, number, None, FileSeal.of)
    except HandrailError:
        return None
    return None if state.fault else state


def _set_aside(layout: Layout, name: str, seal: FileSeal) -> Path | None:
    """Return the file of `.damaged/` with a path and a seal."""
    places = (folder.root / name for folder in folders(layout))
    return next((path for path in places if _has(path, seal)), None)


def _line_set_aside(layout: Layout, number: int, start: int) -> Path | None:
    """Return the line of an episode that was set aside, if all of the episode's files are to be had."""
    for folder in folders(layout):
        record = _readable(folder.row(number))
        if record and (record.episode, record.start) == (number, start):
            files = record.files.items()
            if all(_has(layout.root / name, seal) or _set_aside(layout, name, seal) for name, seal in files):
                return folder.row(number)
    return None


def _has(path: Path, seal: FileSeal) -> bool:
    return path.is_file() and FileSeal.of(path) == seal


def _readable(row: Path) -> EpisodeRecord | None:
    try:
        return read_record(row, with_stats=False)
    except (HandrailError, *UNREADABLE):
        return None


def _forget(folder: Layout, row: Path, state: EpisodeState) -> None:
    """Remove an episode from `.damaged/` that is in the dataset again; its line goes last."""
    assert state.record is not None
    for path in (*(folder.root / name for name in state.record.files), row):
        remove(path)
        sync_folder(path.parent) if path.parent.is_dir() else None


def _remove_empty(folder: Path) -> None:
    """Remove folders that hold nothing."""
    for path in sorted(folder.rglob("*"), reverse=True) if folder.is_dir() else ():
        if path.is_dir() and not any(path.iterdir()):
            path.rmdir()
    if folder.is_dir() and not any(folder.iterdir()):
        folder.rmdir()
