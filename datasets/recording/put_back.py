"""Putting back what lies in `.damaged/`: files where they were, whole episodes at the dataset's end.

An episode that is put back gets the next number, and a mark of the line that it had: cut short at any moment,
this is done again without an episode coming twice. What was set aside is removed only after it is back.
"""

from pathlib import Path

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.layout import Layout, episode_of
from handrail.datasets.format.lines import Lines, read_column_types, rows_of_lines
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import FileSeal, Totals
from handrail.datasets.recording.append import append_episode
from handrail.datasets.recording.content import UNREADABLE
from handrail.datasets.recording.piece import Piece
from handrail.datasets.recording.survey import examine
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
    start = slot = 0
    while slot < (counted if folders(layout) else 0):
        row = layout.row(slot)
        place = row if row.exists() else _line_set_aside(layout, slot, start)
        lines = None if place is None else _readable(place)
        if place is None or lines is None:
            break
        start, slot = start + lines.length, slot + len(lines)
        for name, seal in lines.files.items():
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
    known = {Lines.read(row).origin for row in rows_of_lines(layout)}
    types = read_column_types(layout.row(0)) if before else None
    for folder in folders(layout):
        for row in rows_of_lines(folder):
            origin = FileSeal.of(row).sha256
            lines, places = _whole_ones(folder, manifest, row)
            left = len(lines) if lines else 0
            for record in [lines.record(place, with_stats=True) for place in places] if lines else []:
                mark = origin if record.alone else f"{origin}-{record.episode}"
                if mark not in known:
                    piece, kinds = Piece.of(folder, manifest, record), types or read_column_types(row)
                    try:
                        totals = totals.grown(append_episode(layout, manifest, piece, kinds, totals, mark))
                    except (HandrailError, ValueError):
                        continue  # columns that this dataset does not have, or tasks that do not add up
                    types = kinds
                    known.add(mark)
                left -= 1
            if lines and not left:
                _forget(folder, row, lines)
    _remove_empty(layout.damaged)
    return totals, totals.episodes - before


def _whole_ones(folder: Layout, manifest: Manifest, row: Path) -> tuple[Lines | None, list[int]]:
    """Return the lines of a volume that was set aside, and the places of its whole episodes in them."""
    slot = episode_of(row)
    if slot is None:
        return None, []
    try:
        states, lines = examine(folder, manifest, slot, None, FileSeal.of)
    except HandrailError:
        return None, []
    return lines, [state.number - slot for state in states if not state.fault]


def _set_aside(layout: Layout, name: str, seal: FileSeal) -> Path | None:
    """Return the file of `.damaged/` with a path and a seal."""
    places = (folder.root / name for folder in folders(layout))
    return next((path for path in places if _has(path, seal)), None)


def _line_set_aside(layout: Layout, slot: int, start: int) -> Path | None:
    """Return the lines of a volume that was set aside, if all of its files are to be had."""
    for folder in folders(layout):
        lines = _readable(folder.row(slot))
        if lines and (lines.record(0).episode, lines.record(0).start) == (slot, start):
            files = lines.files.items()
            if all(_has(layout.root / name, seal) or _set_aside(layout, name, seal) for name, seal in files):
                return folder.row(slot)
    return None


def _has(path: Path, seal: FileSeal) -> bool:
    return path.is_file() and FileSeal.of(path) == seal


def _readable(row: Path) -> Lines | None:
    try:
        lines = Lines.read(row)
        return lines if lines.length else None  # each of them is read
    except (HandrailError, *UNREADABLE):
        return None


def _forget(folder: Layout, row: Path, lines: Lines) -> None:
    """Remove a volume from `.damaged/` whose episodes are in the dataset again; its lines go last."""
    for path in (*(folder.root / name for name in lines.files), row):
        remove(path)
        sync_folder(path.parent) if path.parent.is_dir() else None


def _remove_empty(folder: Path) -> None:
    """Remove folders that hold nothing."""
    for path in sorted(folder.rglob("*"), reverse=True) if folder.is_dir() else ():
        if path.is_dir() and not any(path.iterdir()):
            path.rmdir()
    if folder.is_dir() and not any(folder.iterdir()):
        folder.rmdir()
