"""Whether a folder may become a dataset, emptying one that the user gave up, and its quarantine."""

import os
from collections.abc import Iterable
from pathlib import Path

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.layout import DAMAGED, FOLDERS, STAGING, Layout
from handrail.datasets.format.manifest import read_manifest
from handrail.datasets.recording.survey import shortened
from handrail.datasets.storage.atomic import check_room, move, remove
from handrail.datasets.storage.lock import LOCK_NAME

_GIVEN_UP = "episodes"  # the episode rows of a dataset that is being cleared, in the staging folder


def check_target(layout: Layout, overwrite: bool) -> None:
    """Check that a new dataset may be written to a folder; changes nothing.

    Args:
        layout: The dataset to be.
        overwrite: Whether a dataset that Handrail recorded there may go.
    """
    root = layout.root
    check_room(repr(str(root)), root)
    check_folders(layout)
    paths = [path for path in root.iterdir() if path.name != STAGING] if root.is_dir() else []
    names = sorted(path.name for path in paths if not path.is_dir() or any(path.iterdir()))
    if not names:
        return
    if not is_dataset(layout):
        raise HandrailError(
            f"{str(root)!r}: expected a missing or empty folder, found {shortened(names, ', ')}; this"
            " is no LeRobot dataset (no meta/info.json) and is never removed: choose another folder"
        )
    if not overwrite:
        raise HandrailError(
            f"dataset {str(root)!r} exists already: --resume adds to it, --overwrite removes it;"
            " or choose another folder"
        )
    if not layout.manifest.is_file():
        raise HandrailError(
            f"dataset {str(root)!r} was not recorded by Handrail (no meta/handrail.json): never removed;"
            " choose another root"
        )
    if foreign := layout.foreign(read_manifest(layout).features):
        raise HandrailError(
            f"dataset {str(root)!r}: found files that Handrail did not write, {shortened(foreign, ', ')};"
            " --overwrite removes only its own files: move this away, or choose another root"
        )


def check_folders(layout: Layout) -> None:
    """Check that a dataset's folders are its own before anything in them is moved or removed."""
    for top in (layout.root / name for name in (STAGING, DAMAGED, *FOLDERS)):
        for path in (top, *(Path(folder, name) for folder, names, _ in os.walk(top) for name in names)):
            if path.is_symlink():
                raise HandrailError(
                    f"dataset {str(layout.root)!r}: expected a folder, found a link at"
                    f" {layout.relative(path)}; nothing is written through it"
                )


def is_dataset(layout: Layout) -> bool:
    """Return whether a folder holds a LeRobot dataset, whole or not."""
    return layout.info.is_file() or layout.manifest.is_file()


def clear_dataset(layout: Layout) -> None:
    """Remove a dataset that `check_target` lets go, the lock excepted; what lies beside it stays.

    The episode rows go first and at once, into the staging folder: whenever this is cut short later,
    `finish_clearing` goes on, and what is left is an empty dataset, which may be overwritten and resumed.

    Raises:
        OSError: Something cannot be removed.
    """
    clear_staging(layout)
    if layout.episodes.exists():
        os.replace(layout.episodes, layout.staging / _GIVEN_UP)
    _clear_given_up(layout)


def finish_clearing(layout: Layout) -> None:
    """Go on with a `clear_dataset` that was cut short, if there was one.

    Raises:
        OSError: Something cannot be removed.
    """
    if (layout.staging / _GIVEN_UP).exists() and not layout.episodes.exists():
        _clear_given_up(layout)


def _clear_given_up(layout: Layout) -> None:
    """Remove the files of a dataset whose episode rows are in the staging folder; these go last."""
    folders = [layout.root / name for name in ("data", "videos", DAMAGED)]
    meta = layout.tasks, layout.stats, layout.preview, layout.info
    for path in (*folders, *meta, layout.staging / _GIVEN_UP):
        remove(path)


def clear_staging(layout: Layout) -> list[str]:
    """Remove everything in the staging folder but the lock, and return the names."""
    found = layout.staging.iterdir() if layout.staging.is_dir() else ()
    leftovers = sorted(path for path in found if path.name != LOCK_NAME)
    for path in leftovers:
        remove(path)
    return [layout.relative(path) for path in leftovers]


def quarantine(layout: Layout, paths: Iterable[Path]) -> list[str]:
    """Move files into a new numbered folder below `.damaged`; return the paths in the dataset that they had.

    Raises:
        OSError: A file cannot be moved.
    """
    target = next_damaged(layout)
    names = [layout.relative(path) for path in paths]
    for name in names:
        move(layout.root / name, target / name)
    return names


def next_damaged(layout: Layout) -> Path:
    """Return the next folder below `.damaged`."""
    there = [int(path.name) for path in layout.damaged.glob("*") if path.name.isdecimal()]
    return layout.damaged / f"{max(there, default=-1) + 1:03d}"
