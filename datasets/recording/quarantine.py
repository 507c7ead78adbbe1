"""The quarantine of a dataset, `.damaged/`: filling it, and undoing what an older repair left half done."""

from collections.abc import Iterator
from itertools import groupby
from operator import attrgetter
from pathlib import Path

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.lines import Lines, read_column_types
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import FileSeal, Totals, read_encodings
from handrail.datasets.format.schema import video_keys
from handrail.datasets.recording.content import UNREADABLE
from handrail.datasets.recording.piece import Piece
from handrail.datasets.recording.rewrite import write_anew
from handrail.datasets.recording.survey import Survey
from handrail.datasets.storage.atomic import move


def _folders(layout: Layout) -> list[Layout]:
    """Return the folders below `.damaged/`, the newest first; each holds files as a dataset does."""
    found = layout.damaged.iterdir() if layout.damaged.is_dir() else ()
    return [Layout(path) for path in sorted(found, reverse=True) if path.is_dir()]


def restore(layout: Layout, counted: int) -> list[str]:
    """Undo an older repair that was cut short: move files back to where their episode's line expects them.

    Args:
        layout: The dataset.
        counted: How many episodes it should have.

    Returns:
        The paths in the dataset of what was moved back.
    """
    restored: list[str] = []
    start = slot = 0
    while slot < (counted if _folders(layout) else 0):
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
    _remove_empty(layout.damaged)
    return restored


def without_damaged(layout: Layout, manifest: Manifest, found: Survey) -> Totals:
    """Write a dataset anew with its whole episodes; files of the others are kept in `.damaged/`.

    Cut short, nothing has changed, or all of it is done.

    Args:
        layout: The dataset.
        manifest: Its schema.
        found: Its episodes, some of which are not whole.

    Returns:
        What the whole ones add up to.
    """
    slots = dict.fromkeys(state.slot for state in found.damaged)
    kept = [path for slot in slots for path in _files(layout, manifest, slot) if path.exists()]
    first = next((state.slot for state in found.states if not state.fault), None)
    types = {} if first is None else read_column_types(layout.row(first))
    encodings = read_encodings(layout.info, manifest)
    return write_anew(layout.root, manifest, _whole(layout, manifest, found), types, encodings, True, kept)


def _whole(layout: Layout, manifest: Manifest, found: Survey) -> Iterator[Piece]:
    """Yield the whole episodes, a volume in memory at a time."""
    for slot, states in groupby(found.states, attrgetter("slot")):
        if places := [state.number - slot for state in states if not state.fault]:
            lines = Lines.read(layout.row(slot))
            records = (lines.record(place, with_stats=True) for place in places)
            yield from (Piece.of(layout, manifest, record) for record in records)


def _files(layout: Layout, manifest: Manifest, slot: int) -> list[Path]:
    """Return the files of a volume."""
    videos = [layout.video(key, slot) for key in video_keys(manifest.features)]
    return [*videos, layout.data(slot), layout.row(slot)]


def _set_aside(layout: Layout, name: str, seal: FileSeal) -> Path | None:
    """Return the file of `.damaged/` with a path and a seal."""
    places = (folder.root / name for folder in _folders(layout))
    return next((path for path in places if _has(path, seal)), None)


def _line_set_aside(layout: Layout, slot: int, start: int) -> Path | None:
    """Return the lines of a volume that was set aside, if no other files are in its place."""
    for folder in _folders(layout):
        lines = _readable(folder.row(slot))
        if lines and (lines.record(0).episode, lines.record(0).start) == (slot, start):
            places = {layout.root / name: seal for name, seal in lines.files.items()}
            if all(_has(path, seal) or not path.exists() for path, seal in places.items()):
                return folder.row(slot)
    return None


def _remove_empty(folder: Path) -> None:
    """Remove folders that hold nothing."""
    for path in sorted(folder.rglob("*"), reverse=True) if folder.is_dir() else ():
        if path.is_dir() and not any(path.iterdir()):
            path.rmdir()
    if folder.is_dir() and not any(folder.iterdir()):
        folder.rmdir()


def _has(path: Path, seal: FileSeal) -> bool:
    return path.is_file() and FileSeal.of(path) == seal


def _readable(row: Path) -> Lines | None:
    try:
        lines = Lines.read(row)
        return lines if lines.length else None  # each of them is read
    except (HandrailError, *UNREADABLE):
        return None
