"""Writing a dataset anew from episodes of others, whole at every moment.

It is made beside its place, in `.NAME.partial`, and takes its name when it is finished and on the disk. Cut
short before that, nothing has changed; after it, `settle` finishes what is left.
"""

import os
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from handrail.controllers.errors import HandrailError
from handrail.controllers.regular_file import regular
from handrail.datasets.format.columns import ColumnTypes
from handrail.datasets.format.layout import DAMAGED, FOLDERS, STAGING, Layout
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import Totals, info_bytes, stats_bytes
from handrail.datasets.format.tables import tasks_bytes
from handrail.datasets.recording.folder import clear_staging, next_damaged
from handrail.datasets.recording.piece import Piece
from handrail.datasets.recording.volume import write_volumes
from handrail.datasets.storage.atomic import (
    beside,
    make_folder,
    publish_folder,
    remove,
    replace,
    sync_file,
    sync_folder,
)
from handrail.datasets.storage.lock import DatasetLock

Encodings = Mapping[str, Mapping[str, Any]]
_OURS = (*FOLDERS, STAGING, DAMAGED)


def write_anew(
    root: Path,
    manifest: Manifest,
    pieces: Iterable[Piece],
    types: ColumnTypes,
    encodings: Encodings,
    in_place: bool = False,
    damaged: Sequence[Path] | None = None,
) -> Totals:
    """Write a dataset in one pass over its pieces, in files of many episodes.

    Args:
        root: Its folder; what is there is replaced.
        manifest: Its schema.
        pieces: Its episodes, in order.
        types: Of its extra columns.
        encodings: How its videos are encoded, where that is not as Handrail does it.
        in_place: Whether the pieces are of the dataset that is replaced: what lies beside its files stays.
        damaged: Files of the dataset that is replaced, which are kept in its `.damaged/`; no piece need be
            left then.

    Returns:
        What the episodes add up to.

    Raises:
        HandrailError: There is no piece, one does not fit, or another process writes there. Nothing has been
            changed then.
        OSError: The disk does not take it.
    """
    with drafted(root) as draft:
        totals = write_volumes(draft, manifest, pieces, types)
        if not totals.episodes and damaged is None:
            raise HandrailError(
                f"{str(root)!r}: expected at least one episode, got none; nothing was written"
            )
        replace(draft.manifest, manifest.to_bytes(), draft.staging)
        if totals.episodes:
            replace(draft.tasks, tasks_bytes(totals.tasks), draft.staging)
            replace(draft.stats, stats_bytes(totals.stats or {}), draft.staging)
        replace(draft.info, info_bytes(manifest, totals, encodings), draft.staging)
        if in_place:
            _carry_over(root, draft.root)
        if damaged is not None:
            _keep(Layout(root), draft, damaged)
    return totals


@contextmanager
def drafted(root: Path) -> Iterator[Layout]:
    """Provide an empty folder that takes the place of another, once it is finished and on the disk.

    Raises:
        HandrailError: Another process writes there.
        OSError: The disk does not take it.
    """
    draft = Layout(_draft(root))
    with DatasetLock(draft.staging):
        try:
            _clear(draft)
            yield draft
        except BaseException:
            remove(draft.root)
            raise
    publish_folder(draft.root, root)


def remove_whole(root: Path) -> None:
    """Remove a dataset, at once: cut short, `settle` goes on."""
    remove(_draft(root))
    os.replace(root, _draft(root))
    sync_folder(root.parent)
    remove(_draft(root))


def settle(root: Path) -> bool:
    """Finish a writing anew that was cut short; return whether one was past the point of no return.

    Raises:
        OSError: Something cannot be renamed or removed.
    """
    old, draft = _old(root), _draft(root)
    finished = old.exists()
    if finished:
        if not root.exists():
            os.replace(draft if draft.exists() else old, root)
            sync_folder(root.parent)
        remove(old)
    if not _in_use(draft):
        remove(draft)
    return finished


def _in_use(draft: Path) -> bool:
    """Return whether another process writes a draft."""
    if not draft.is_dir():
        return False
    try:
        DatasetLock(draft / STAGING).release()
    except HandrailError:
        return True
    return False


def _clear(draft: Layout) -> None:
    """Remove what a writing that was cut short left in a draft."""
    for path in draft.root.iterdir():
        if path != draft.staging:
            remove(path)
    clear_staging(draft)


def _carry_over(root: Path, draft: Path) -> None:
    """Copy what lies in a dataset's folder and is not the dataset."""
    for path in root.iterdir():
        if path.name in _OURS:
            continue
        if path.is_dir() and not path.is_symlink():
            shutil.copytree(path, draft / path.name, symlinks=True)
        elif path.is_symlink():
            os.symlink(os.readlink(path), draft / path.name)
        else:
            _copy_file(path, draft / path.name)


def _keep(layout: Layout, draft: Layout, damaged: Sequence[Path]) -> None:
    """Copy what lies in `.damaged/`, and files into a new folder there, at the same place in it."""
    if layout.damaged.is_dir():
        shutil.copytree(layout.damaged, draft.damaged)
    target = next_damaged(draft)
    for path in damaged:
        _copy_file(path, target / layout.relative(path))


def _copy_file(source: Path, target: Path) -> None:
    """Give a file a second name, or copy it where the file system has no such thing."""
    make_folder(target.parent)
    remove(target)
    try:
        os.link(regular(source), target)
    except OSError:
        shutil.copyfile(regular(source), target)
    sync_file(target)


def _draft(root: Path) -> Path:
    return beside(root, "partial")


def _old(root: Path) -> Path:
    return beside(root, "old")  # as `publish_folder` calls it
