"""Episodes that are not whole, taken out of a dataset; and what an older repair left half done, undone."""

from collections.abc import Iterator
from pathlib import Path

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.episode_rows import EpisodeRows, read_column_types
from handrail.datasets.format.info_file import read_encodings
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import Checksum, Totals
from handrail.datasets.format.schema import video_keys
from handrail.datasets.recording.content import UNREADABLE
from handrail.datasets.recording.rewrite import write_anew
from handrail.datasets.recording.slice import EpisodeSlice
from handrail.datasets.recording.survey import Survey
from handrail.datasets.storage.atomic import move


def restore(layout: Layout, counted: int) -> list[str]:
    """Undo an older repair that was cut short: move files back to where their episode rows expect them.

    Args:
        layout: The dataset.
        counted: How many episodes it should have.

    Returns:
        The paths in the dataset of what was moved back.
    """
    found = layout.damaged.iterdir() if layout.damaged.is_dir() else ()
    folders = [Layout(path) for path in sorted(found, reverse=True) if path.is_dir()]  # the newest first
    restored: list[str] = []
    start = first = 0
    while folders and first < counted:
        row = layout.row(first)
        kept = (folder.row(first) for folder in folders if _belongs(layout, folder.row(first), first, start))
        place = row if row.exists() else next(kept, None)
        rows = _readable(place)
        if place is None or rows is None:
            break
        start, first = start + rows.length, first + len(rows)
        for name, checksum in rows.files.items():
            sources = [folder.root / name for folder in folders if _has(folder.root / name, checksum)]
            if sources and not (layout.root / name).exists():
                move(sources[0], layout.root / name)
                restored.append(name)
        if place != row:
            move(place, row)
            restored.append(layout.relative(row))
    for path in sorted(layout.damaged.rglob("*"), reverse=True) if folders else ():
        if path.is_dir() and not any(path.iterdir()):
            path.rmdir()
    if layout.damaged.is_dir() and not any(layout.damaged.iterdir()):
        layout.damaged.rmdir()
    return restored


def without_damaged(found: Survey, manifest: Manifest) -> Totals:
    """Write a dataset anew with its whole episodes; files of the others are kept in `.damaged/`.

    Cut short, nothing has changed, or all of it is done.

    Args:
        found: Its episodes, some of which are not whole.
        manifest: Its schema.

    Returns:
        What the whole ones add up to.
    """
    layout, kept = found.layout, list[Path]()
    for first in (group.first for group in found.groups if any(group.faults)):
        videos = [layout.video(key, first) for key in video_keys(manifest.features)]
        kept += [path for path in (*videos, layout.data(first), layout.row(first)) if path.exists()]
    whole = next((group.first for group in found.groups if not all(group.faults)), None)
    types = {} if whole is None else read_column_types(layout.row(whole))
    encodings = read_encodings(layout, manifest)
    return write_anew(layout.root, manifest, _whole(found, manifest), types, encodings, True, kept)


def _whole(found: Survey, manifest: Manifest) -> Iterator[EpisodeSlice]:
    """Yield the whole episodes, a file group in memory at a time."""
    for group in found.groups:
        if not all(group.faults):
            rows = EpisodeRows.read(found.layout.row(group.first))
            for place, fault in enumerate(group.faults):
                if not fault:
                    yield EpisodeSlice.of(found.layout, manifest, rows.record(place, with_stats=True))


def _belongs(layout: Layout, row: Path, first: int, start: int) -> bool:
    """Return whether episode rows in quarantine are those of an episode, with no other files in its place."""
    rows = _readable(row)
    if rows is None or (rows.record(0).episode, rows.record(0).start) != (first, start):
        return False
    places = {layout.root / name: checksum for name, checksum in rows.files.items()}
    return all(_has(path, checksum) or not path.exists() for path, checksum in places.items())


def _has(path: Path, checksum: Checksum) -> bool:
    return path.is_file() and Checksum.of(path) == checksum


def _readable(row: Path | None) -> EpisodeRows | None:
    try:
        rows = EpisodeRows.read(row) if row else None
        return rows if rows and rows.length else None  # each of them is read
    except (HandrailError, *UNREADABLE):
        return None
