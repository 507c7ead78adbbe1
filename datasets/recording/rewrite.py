"""Writing a dataset anew from episodes of others, whole at every moment.

It is made beside its place, in `.NAME.partial`, and takes its name when it is finished and on the disk. Cut
short before that, nothing has changed; after it, `settle` finishes what is left.
"""

import os
import shutil
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path

from handrail.controllers.errors import HandrailError
from handrail.controllers.regular_file import regular
from handrail.datasets.format.info_file import Encodings, summary_files
from handrail.datasets.format.layout import FOLDERS, STAGING, Layout
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import ColumnTypes, Totals
from handrail.datasets.recording.file_group import GroupWriter
from handrail.datasets.recording.folder import clear_staging, is_dataset, next_damaged
from handrail.datasets.recording.slice import EpisodeSlice
from handrail.datasets.storage.atomic import beside, make_folder, publish_folder, remove, sync, write_whole
from handrail.datasets.storage.lock import FolderLock, HeldError


def write_anew(
    root: Path,
    manifest: Manifest,
    slices: Iterable[EpisodeSlice],
    types: ColumnTypes,
    encodings: Encodings,
    in_place: bool = False,
    damaged: Sequence[Path] | None = None,
) -> Totals:
    """Write a dataset in one pass over its episodes, in files of many; return what they add up to.

    Args:
        root: Its folder; what is there is replaced.
        manifest: Its schema.
        slices: Its episodes, in order.
        types: Of its extra columns.
        encodings: How its videos are encoded, where that is not as Handrail does it.
        in_place: Whether the slices are of the dataset that is replaced: what lies beside its files stays,
            its quarantine too.
        damaged: Files of the dataset that is replaced, for its quarantine; then no episode need be left.

    Raises:
        HandrailError: There is no episode, one does not fit, or another process writes there. Nothing has
            been changed then.
        OSError: The disk does not take it.
    """
    with drafted(root, in_place) as draft:
        with closing(GroupWriter(draft, manifest, types)) as writer:
            for each in slices:
                writer.add(each)
            writer.finish()
        totals = writer.totals
        if not totals.episodes and damaged is None:
            raise HandrailError(f"{str(root)!r}: expected at least one episode; nothing was written")
        summary = summary_files(draft, manifest, totals, encodings)
        for path, data in {draft.manifest: manifest.to_bytes(), **summary}.items():
            if data is not None:
                write_whole(path, data, draft.staging)
        if in_place:
            _copy_beside(root, draft.root)
            for name in Layout(root).foreign(manifest.features):
                if not (root / name).is_symlink():  # it may stand for a file of the old dataset
                    _second_name(root / name, draft.root / name)
        quarantine = next_damaged(draft)
        for path in damaged or ():
            _second_name(path, quarantine / path.relative_to(root))
    return totals


@contextmanager
def drafted(root: Path, replacing: bool = False) -> Iterator[Layout]:
    """Provide an empty folder that takes a name, once it is finished and on the disk.

    Args:
        root: The name.
        replacing: Whether it takes the place of a folder, whose lock the caller holds.

    Raises:
        HandrailError: Another process writes there.
        OSError: The disk does not take it, or somebody else has taken the name meanwhile.
    """
    draft = Layout(_draft(root))
    with _locked(draft) as lock:
        if (old := beside(root, "replaced")).exists():
            raise HeldError(f"{str(old)!r} is still there: another edit is at work, or could not remove it")
        try:
            _clear(draft)  # of a writing that was cut short
            yield draft
            clear_staging(draft)
            publish_folder(draft.root, root, replacing)
        except BaseException:
            if is_dataset(Layout(root)) or not replacing:  # else it has no name, and `settle` goes on
                _clear(draft)
            raise
        lock.moved(Layout(root).staging)


def rename_away(root: Path) -> None:
    """Take a dataset's name from it, at once; `settle` removes it, once its lock is free."""
    remove(_draft(root))
    os.replace(root, _draft(root))
    sync(root.parent)


def left_of(root: Path) -> str:
    """Return a hint if files of the dataset that was replaced could not be removed; else ""."""
    old = beside(root, "replaced")
    if any(path.is_file() for folder in FOLDERS for path in (old / folder).rglob("*")):
        return f"{str(old)!r} could not be removed and holds what was there: remove it"
    return ""


def settle(root: Path) -> bool:
    """Finish a writing anew that was cut short; return whether one was past the point of no return.

    Raises:
        HeldError: It is not cut short: another process is writing.
        OSError: Something cannot be renamed or removed.
    """
    old, draft, dataset = beside(root, "replaced"), Layout(_draft(root)), Layout(root)
    if not (old.exists() or draft.root.exists()):  # as `publish_folder` calls them
        return False
    with _locked(draft) as lock:
        finished = any(not path.is_dir() for path in old.rglob("*"))  # folders alone are what NFS keeps
        if is_dataset(Layout(old)) and not is_dataset(dataset):  # cut short between its two names
            if is_dataset(draft):
                os.replace(draft.root, root)
                lock.moved(dataset.staging)
            else:
                os.replace(old, root)
            sync(root.parent)
        if is_dataset(dataset):
            shutil.rmtree(old, ignore_errors=True)
        _clear(draft)
    return finished and not old.exists()


@contextmanager
def _locked(draft: Layout) -> Iterator[FolderLock]:
    """Hold the lock of a draft, whose folder goes afterwards if it is empty.

    Not before: NFS keeps an open file, such as the lock, under another name until it is closed.
    """
    try:
        with FolderLock(draft.staging) as lock:
            yield lock
    finally:
        with suppress(OSError):
            draft.root.rmdir()


def _clear(draft: Layout) -> None:
    """Empty a draft's folder, but for its lock; it may have been renamed already."""
    if draft.root.exists():
        clear_staging(draft)
        for path in set(draft.root.iterdir()) - {draft.staging}:
            remove(path)


def _copy_beside(root: Path, target: Path) -> None:
    """Copy what lies beside a dataset's own folders."""

    def ours(folder: str, _: list[str]) -> Sequence[str]:
        return (*FOLDERS, STAGING) if Path(folder) == root else ()

    shutil.copytree(root, target, symlinks=True, ignore=ours, copy_function=_second_name, dirs_exist_ok=True)


def _second_name(source: str | Path, target: str | Path) -> None:
    """Give a file a second name, or copy it where the file system has no such thing."""
    remove(Path(target))
    make_folder(Path(target).parent)
    try:
        os.link(regular(Path(source)), target)
    except OSError:
        shutil.copyfile(regular(Path(source)), target)


def _draft(root: Path) -> Path:
    return beside(root, "partial")
