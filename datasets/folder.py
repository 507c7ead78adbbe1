"""Whether a folder may become a dataset, and emptying one that the user gave up."""

import os
from pathlib import Path

from handrail.controllers.errors import HandrailError
from handrail.datasets.atomic import make_folder, move, remove
from handrail.datasets.layout import DAMAGED, STAGING, Layout
from handrail.datasets.lock import LOCK_NAME

_OWNED = ("data", "videos", "images", DAMAGED)  # what `overwrite` removes, before `meta`


def check_target(layout: Layout, overwrite: bool) -> None:
    """Check that a new dataset may be written to a folder; changes nothing.

    Args:
        layout: The dataset to be.
        overwrite: Whether a dataset that is there may go.

    Raises:
        HandrailError: The path is no folder or cannot be written, or something is there.
    """
    root = layout.root
    _check_writable(root)
    if not root.is_dir() or not _contents(root):
        return
    if not is_dataset(layout):
        raise HandrailError(
            f"{str(root)!r}: expected a missing or empty folder, found {_listed(root)}; this is no LeRobot"
            " dataset (no meta/info.json) and is never removed: choose another folder"
        )
    if not overwrite:
        raise HandrailError(
            f"dataset {str(root)!r} exists already: --resume adds to it, --overwrite removes it;"
            " or choose another folder"
        )


def is_dataset(layout: Layout) -> bool:
    """Return whether a folder holds a LeRobot dataset, whole or not."""
    return layout.info.is_file() or layout.manifest.is_file()


def clear_dataset(layout: Layout) -> None:
    """Remove a dataset's own files and folders, the lock excepted; other files in the folder stay.

    The lines of metadata go first and at once, `info.json` last: whenever this is cut short, what is left is
    an empty dataset with leftovers, which `overwrite` and `resume` both accept.

    Raises:
        OSError: Something cannot be removed.
    """
    clear_staging(layout)
    episodes = layout.root / "meta" / "episodes"
    if episodes.exists():
        os.replace(episodes, layout.staging / "episodes")
    for name in _OWNED:
        remove(layout.root / name)
    meta = layout.root / "meta"
    others = (
        [path for path in meta.iterdir() if path not in (layout.info, layout.manifest)]
        if meta.is_dir()
        else []
    )
    for path in (*others, layout.staging / "episodes", layout.info):
        remove(path)


def clear_staging(layout: Layout) -> list[str]:
    """Remove everything in the staging folder but the lock, and return the names."""
    if not layout.staging.is_dir():
        return []
    leftovers = sorted(path for path in layout.staging.iterdir() if path.name != LOCK_NAME)
    for path in leftovers:
        remove(path)
    return [layout.relative(path) for path in leftovers]


def set_aside(layout: Layout, paths: list[Path]) -> list[str]:
    """Move files into a new numbered folder below `.damaged`, at the same place in it.

    Returns:
        The paths in the dataset that they had.

    Raises:
        OSError: A file cannot be moved.
    """
    if not paths:
        return []
    number = 0
    while (target := layout.damaged / f"{number:03d}").exists():
        number += 1
    make_folder(target)
    for path in paths:
        move(path, target / layout.relative(path))
    return [layout.relative(path) for path in paths]


def _contents(root: Path) -> list[str]:
    """Return the names in a folder, but for the staging folder and folders that are empty."""
    paths = [path for path in root.iterdir() if path.name != STAGING]
    return sorted(path.name for path in paths if not path.is_dir() or any(path.iterdir()))


def _listed(root: Path) -> str:
    names = _contents(root)
    return ", ".join(names[:3]) + (" …" if len(names) > 3 else "")


def _check_writable(root: Path) -> None:
    existing = root
    while not existing.exists() and existing != existing.parent:
        existing = existing.parent
    if not existing.is_dir():
        raise HandrailError(f"{str(root)!r}: expected a folder, but {str(existing)!r} is a file")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise HandrailError(
            f"{str(root)!r}: expected a folder that can be written, but {str(existing)!r} cannot"
        )
