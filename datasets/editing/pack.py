"""Packing and merging: whole datasets become one, in files of many episodes, in one pass."""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any

from handrail.controllers.errors import HandrailError
from handrail.datasets.editing.merge import check_alike, merged_encodings, merged_types
from handrail.datasets.editing.source import EditSource
from handrail.datasets.format.episode_rows import row_files
from handrail.datasets.format.layout import Layout
from handrail.datasets.recording.checksums import Checksums
from handrail.datasets.recording.repair import tidy_locked
from handrail.datasets.recording.rewrite import remove_whole, settle, write_anew
from handrail.datasets.storage.atomic import explained
from handrail.datasets.storage.lock import DatasetLock


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


def merge_datasets(
    roots: Sequence[str | Path], output: str | Path, name: str = "", verify: bool = False
) -> Edited:
    """Write the episodes of datasets, in their order, as one dataset with files of many episodes.

    Args:
        roots: Their folders, one or more; some of several may have no episode yet.
        output: Folder of the new dataset, missing or empty; or one of `roots`, which is replaced at once when
            the new dataset is whole.
        name: Of the new dataset, `owner/name`; that of the first folder when empty.
        verify: Read every file of the datasets anew, also those that have not changed since the last check.
    """
    target = Path(output).expanduser().absolute()
    given = [Path(root).expanduser().absolute() for root in roots]
    real = [os.path.realpath(root) for root in given]
    if twice := [str(root) for root, place in zip(given, real, strict=True) if real.count(place) > 1]:
        raise HandrailError(f"merge: expected each folder once, got {twice[0]!r} twice")
    places = [root for root in given if root == target or not _is_empty(root)] or given
    with explained(f"cannot write {str(target)!r}"):
        if target not in places:
            check_free(target)
            return _merged([EditSource.open(place, verify) for place in places], target, name, in_place=False)
        with taken(target, verify) as own:
            sources = [own if place == target else EditSource.open(place, verify) for place in places]
            return _merged(sources, target, name, in_place=True)


def _is_empty(root: Path) -> bool:
    """Return whether a dataset was begun, and nothing has been recorded."""
    return Layout(root).manifest.is_file() and not row_files(Layout(root))


def check_free(target: Path) -> None:
    """Check that nothing lies where a dataset is to be written."""
    if target.exists() and (not target.is_dir() or any(target.iterdir())):
        raise HandrailError(f"--output {target}: expected a missing or empty folder, found one in use")


@contextmanager
def taken(root: Path, verify: bool) -> Iterator[EditSource]:
    """Provide a dataset that is to be replaced, with the sole right to write to it."""
    if settle(root):
        raise HandrailError(
            f"dataset {str(root)!r}: an edit was cut short, and is finished now; look at it (handrail-inspect"
            f" {root}) before the next"
        )
    source = EditSource.open(root)
    if source.layout.damaged.exists():
        raise HandrailError(
            f"dataset {str(root)!r}: in {source.layout.damaged.name} are episodes that were set aside;"
            " some may have to go too: remove that folder"
        )
    with DatasetLock(source.layout.staging):
        tidy_locked(source.layout, source.manifest, Checksums(root, anew=verify))
        yield source


def drop_episodes(root: str | Path, dropped: Callable[[Mapping[str, Any]], bool]) -> int:
    """Remove episodes from a dataset that Handrail wrote, for good; return how many.

    Args:
        root: Its folder; removed too if no episode is left.
        dropped: Says by an episode's line of metadata whether it goes.
    """
    root = Path(root).expanduser().absolute()
    with explained(f"cannot remove episodes from dataset {str(root)!r}"):
        settle(root)  # what was cut short is done; dropping the same again does no harm
        if _is_empty(root):
            return 0
        with taken(root, verify=True) as source:
            kept = [row["episode_index"] for row in source.rows if not dropped(row)]
            if 0 < len(kept) < len(source.rows):
                pieces = source.slices(kept)
                write_anew(root, source.manifest, pieces, source.types, source.encodings, in_place=True)
            elif not kept:
                remove_whole(root)
        return len(source.rows) - len(kept)


def _merged(sources: Sequence[EditSource], target: Path, name: str, in_place: bool) -> Edited:
    for other in sources[1:]:
        check_alike(sources[0], other)
    manifest = replace(sources[0].manifest, repo_id=name or sources[0].manifest.repo_id)
    manifest.check()
    pieces = chain.from_iterable(source.slices() for source in sources)
    types, encodings = merged_types(sources), merged_encodings(sources)
    totals = write_anew(target, manifest, pieces, types, encodings, in_place)
    return Edited(target, totals.episodes, totals.frames, sum(source.info.frames for source in sources))
