"""Bringing a dataset that Handrail wrote into order, without losing an episode that was saved.

A saved episode stays where it is: an episode that is not whole is named, and kept in `.damaged/` only when
asked (`set_aside`), whereupon those after it move up. The remains of a crash (staged files, the published
files of the one episode that was never saved) are removed. `info.json`, `stats.json` and `tasks.parquet` are
rebuilt if they are not, to the byte, what the episodes say.

    handrail-edit repair path/to/dataset
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from handrail.datasets.format.episode_rows import EpisodeRows, read_column_types, with_checksums
from handrail.datasets.format.info_file import read_encodings, summary_files
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.manifest import Manifest, read_manifest
from handrail.datasets.format.metadata import Totals
from handrail.datasets.format.schema import video_keys
from handrail.datasets.recording.checksums import Checksums
from handrail.datasets.recording.folder import check_folders, clear_staging, finish_clearing, quarantine
from handrail.datasets.recording.rewrite import settle, write_anew
from handrail.datasets.recording.slice import EpisodeSlice
from handrail.datasets.recording.survey import Survey, shortened, survey
from handrail.datasets.storage.atomic import explained, followed, remove, sync, write_whole
from handrail.datasets.storage.lock import FolderLock

REWRITTEN = "whole, but as another tool wrote them"  # a repair renews their checksums
REMOVED = "leftovers removed"  # of an interrupted recording
MOVED = "files of no episode moved to .damaged"
REBUILT = "written anew"  # summary files


@dataclass(frozen=True)
class RepairReport:
    """The findings and changes of a repair; printing it gives one line."""

    root: Path
    episodes: int
    """Number of episodes in it now."""
    damage: tuple[str, ...] = ()
    """Faults of the episodes that are not whole and still in their place."""
    lost: tuple[str, ...] = ()
    """Faults of the episodes that are in quarantine now."""
    done: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Paths in the dataset by what became of them."""

    @property
    def clean(self) -> bool:
        """Whether there was nothing to do."""
        return self.complete and not any(self.done.values())

    @property
    def complete(self) -> bool:
        """Whether everything that was saved is in the dataset and whole."""
        return not (self.damage or self.lost)

    def __str__(self) -> str:
        said = [f"dataset {str(self.root)!r}: {self.episodes} episodes"]
        said += [f"{len(self.damage)} damaged ({shortened(self.damage)})"] if self.damage else []
        said += [f"{len(self.lost)} set aside in .damaged ({shortened(self.lost)})"] if self.lost else []
        said += [f"{what}: {shortened(paths, ', ')}" for what, paths in self.done.items() if paths]
        return "; ".join([*said, "nothing to repair"] if self.clean else said)


def repair(root: str | Path, set_aside_damaged: bool = False) -> RepairReport:
    """Repair a dataset; doing it twice changes nothing more. Every byte is read.

    Args:
        root: The dataset's folder.
        set_aside_damaged: Whether episodes that are not whole go to the quarantine; without, they are named.
    """
    layout = Layout(followed(root))
    with explained(f"cannot repair dataset {str(layout.root)!r}"):
        settle(layout.root)
        read_manifest(layout)
        check_folders(layout)
        with FolderLock(layout.staging, existing=True):
            manifest = read_manifest(layout)  # again: an edit may have been faster
            finish_clearing(layout)
            found = survey(layout, manifest, Checksums(layout.root, anew=True))
            done = _clear(found)
            for group in found.groups:
                if group.rewritten and not all(group.faults):
                    row = layout.row(group.first)
                    write_whole(row, with_checksums(row, group.rewritten), layout.staging)
            counted = found.totals.episodes == found.episodes
            done[REBUILT] = _rebuild(layout, manifest, found.totals) if counted else ()
            if found.damage and set_aside_damaged:
                totals = _without_damaged(found, manifest)
                return RepairReport(layout.root, totals.episodes, lost=found.damage, done=done)
            return RepairReport(layout.root, found.episodes, found.damage, done=done)


def tidy_locked(layout: Layout, manifest: Manifest, sums: Checksums) -> tuple[RepairReport, Totals]:
    """Clear what a crash left in a dataset whose episodes are whole and whose lock the caller holds.

    Returns:
        What was done, and what the episodes add up to.

    Raises:
        HandrailError: An episode is not whole, or another tool has added some. Nothing has been changed then.
        OSError: A file cannot be moved, removed or written.
    """
    finish_clearing(layout)
    found = survey(layout, manifest, sums)
    found.require_whole()
    done = _clear(found)
    done[REBUILT] = _rebuild(layout, manifest, found.totals)
    return RepairReport(layout.root, found.episodes, done=done), found.totals


def _clear(found: Survey) -> dict[str, tuple[str, ...]]:
    """Remove what a crash left, and put what nobody can explain into quarantine; return all of these."""
    for path in found.leftovers:
        remove(path)
    for folder in {path.parent for path in found.leftovers}:
        sync(folder)
    layout = found.layout
    removed = (*clear_staging(layout), *map(layout.relative, found.leftovers))
    moved = tuple(quarantine(layout, found.unknown))
    return {REWRITTEN: found.rewritten, REMOVED: removed, MOVED: moved}


def _rebuild(layout: Layout, manifest: Manifest, totals: Totals) -> tuple[str, ...]:
    """Write the summary files that are not what the episodes say; return which."""
    wanted = summary_files(layout, manifest, totals, read_encodings(layout, manifest))
    rebuilt = []
    for path, data in wanted.items():
        if (path.read_bytes() if path.is_file() else None) == data:
            continue
        rebuilt.append(layout.relative(path))
        if data is None:
            remove(path)
            sync(path.parent)
        else:
            write_whole(path, data, layout.staging)
    return tuple(rebuilt)


def _without_damaged(found: Survey, manifest: Manifest) -> Totals:
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
