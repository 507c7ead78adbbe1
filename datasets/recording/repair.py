"""Bringing a dataset that Handrail wrote into order, without losing an episode that was saved.

Whatever was saved stays where it is: an episode that is not whole is named, and kept in `.damaged/` only when
asked (`set_aside`), whereupon those after it move up. What a crash leaves behind (staged files, the published
files of the one episode that was never saved) is removed. `info.json`, `stats.json` and `tasks.parquet` are
rebuilt if they are not, to the byte, what the episodes say.

    handrail-edit repair path/to/dataset
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.lines import resealed_bytes
from handrail.datasets.format.manifest import Manifest, read_manifest
from handrail.datasets.format.metadata import Totals, info_bytes, read_encodings, stats_bytes
from handrail.datasets.format.tables import tasks_bytes
from handrail.datasets.recording.checksums import Checksums
from handrail.datasets.recording.folder import check_folders, clear_staging, finish_clearing, set_aside
from handrail.datasets.recording.quarantine import restore, without_damaged
from handrail.datasets.recording.rewrite import settle
from handrail.datasets.recording.survey import Survey, said_to_be_saved, survey
from handrail.datasets.storage.atomic import explained, remove, replace, sync_folder
from handrail.datasets.storage.lock import DatasetLock

_SHOWN = 3  # faults in one line


@dataclass(frozen=True)
class RepairReport:
    """What a repair found and did; printing it gives one line.

    Attributes:
        root: The dataset.
        episodes: Number of episodes in it now.
        damage: What is wrong with each episode that is not whole and still in its place.
        lost: What was wrong with each episode that was set aside.
        rewritten: Files that another tool wrote anew and that are whole; a repair renews their checksums.
        removed: Leftovers of an interrupted recording, deleted; paths in the dataset.
        moved: Files set aside in `.damaged/`; the paths that they had.
        restored: Files moved back from there to where they were.
        rebuilt: Summary files written anew.
    """

    root: Path
    episodes: int
    damage: tuple[str, ...] = ()
    lost: tuple[str, ...] = ()
    rewritten: tuple[str, ...] = ()
    removed: tuple[str, ...] = ()
    moved: tuple[str, ...] = ()
    restored: tuple[str, ...] = ()
    rebuilt: tuple[str, ...] = ()

    @property
    def clean(self) -> bool:
        """Whether there was nothing to do."""
        return not (self.damage or self.lost or any(self._files().values()))

    @property
    def complete(self) -> bool:
        """Whether everything that was saved is in the dataset and whole."""
        return not (self.damage or self.lost)

    def __str__(self) -> str:
        said = [f"dataset {str(self.root)!r}: {self.episodes} episodes"]
        said += [f"{len(self.damage)} damaged ({shortened(self.damage)})"] if self.damage else []
        said += [f"{len(self.lost)} set aside in .damaged ({shortened(self.lost)})"] if self.lost else []
        said += [f"{what}: {shortened(paths, ', ')}" for what, paths in self._files().items() if paths]
        return "; ".join(said if not self.clean else [*said, "nothing to repair"])

    def _files(self) -> dict[str, tuple[str, ...]]:
        return {
            "whole, but as another tool wrote them": self.rewritten,
            "leftovers removed": self.removed,
            "files of no episode moved to .damaged": self.moved,
            "files moved back": self.restored,
            "written anew": self.rebuilt,
        }


def shortened(texts: tuple[str, ...] | list[str], comma: str = "; ") -> str:
    """Return the first few of many texts, and how many more there are."""
    more = f" and {len(texts) - _SHOWN} more" if len(texts) > _SHOWN else ""
    return comma.join(texts[:_SHOWN]) + more


def repair(root: str | Path, set_aside_damaged: bool = False) -> RepairReport:
    """Repair a dataset; doing it twice changes nothing more. Every byte is read.

    Args:
        root: The dataset's folder.
        set_aside_damaged: Whether to set episodes aside that are not whole; without, they stay and are named.
    """
    layout = Layout(Path(root).expanduser().absolute())
    with explained(f"cannot repair dataset {str(layout.root)!r}"):
        settle(layout.root)
        manifest = read_manifest(layout)
        check_folders(layout)
        with DatasetLock(layout.staging):
            return _repair_locked(layout, manifest, set_aside_damaged)


def tidy_locked(layout: Layout, manifest: Manifest, sums: Checksums) -> tuple[RepairReport, Totals]:
    """Clear what a crash left in a dataset whose episodes are whole and whose lock the caller holds.

    Returns:
        What was done, and what the episodes add up to.

    Raises:
        HandrailError: An episode is not whole, or another tool has added some. Nothing has been changed then.
        OSError: A file cannot be moved, removed or written.
    """
    finish_clearing(layout)
    found = survey(layout, manifest, sums.of)
    sums.remember()
    require_whole(layout, found)
    done = _clear(layout, found)
    rebuilt = _rebuild(layout, manifest, found.totals)
    return _report(layout, found, found.totals, rebuilt=rebuilt, **done), found.totals


def _report(layout: Layout, found: Survey, totals: Totals, **done: Any) -> RepairReport:
    count = max(totals.episodes, len(found.states) + found.absent)
    return RepairReport(layout.root, count, tuple(found.faults()), **done)


def require_whole(layout: Layout, found: Survey) -> None:
    """Check that no episode is damaged."""
    if found.whole:
        return
    faults, count = found.faults(), len(found.states) + found.absent
    lacking = found.absent or all("missing" in state.fault for state in found.damaged)
    what = "was copied in part" if lacking else "is damaged"
    raise HandrailError(
        f"dataset {str(layout.root)!r} {what}: {len(found.damaged) + found.absent} of {count} episodes are"
        f" not whole ({shortened(faults)}); nothing has been changed; copy it again, see what"
        f" handrail-edit repair {layout.root} can mend, or go on without them with its --set_aside"
    )


def _repair_locked(layout: Layout, manifest: Manifest, set_aside_damaged: bool) -> RepairReport:
    finish_clearing(layout)
    sums = Checksums(layout.root, anew=True)
    restored = restore(layout, said_to_be_saved(layout))
    found = survey(layout, manifest, sums.of)
    done = _clear(layout, found)
    _reseal(layout, found)
    rebuilt = _rebuild(layout, manifest, found.totals) if found.counted else ()
    sums.remember()
    done |= {"restored": tuple(restored), "rebuilt": rebuilt}
    if found.whole or not set_aside_damaged:
        return _report(layout, found, found.totals, **done)
    totals = without_damaged(layout, manifest, found)
    return RepairReport(layout.root, totals.episodes, lost=tuple(found.faults()), **done)


def _clear(layout: Layout, found: Survey) -> dict[str, tuple[str, ...]]:
    """Remove what a crash left and set aside what nobody can explain; return all of these."""
    for path in found.leftovers:
        remove(path)
    for folder in {path.parent for path in found.leftovers}:
        sync_folder(folder)
    removed = [*clear_staging(layout), *map(layout.relative, found.leftovers)]
    return {
        "rewritten": tuple(dict.fromkeys(name for state in found.rewritten for name in state.rewritten)),
        "removed": tuple(removed),
        "moved": tuple(set_aside(layout, list(found.strays))),
    }


def _reseal(layout: Layout, found: Survey) -> None:
    """Renew the checksums of files that another tool wrote anew and that are whole."""
    for state in {state.slot: state for state in found.rewritten}.values():
        assert state.record is not None
        row, files = layout.row(state.slot), {**state.record.files, **state.rewritten}
        replace(row, resealed_bytes(row, files), layout.staging)


def _rebuild(layout: Layout, manifest: Manifest, totals: Totals) -> tuple[str, ...]:
    """Write the summary files that are not what the episodes say."""
    encodings = read_encodings(layout.info, manifest)
    wanted = {
        layout.tasks: tasks_bytes(totals.tasks) if totals.tasks else None,
        layout.stats: stats_bytes(totals.stats) if totals.stats else None,
        layout.info: info_bytes(manifest, totals, encodings),
    }
    return tuple(layout.relative(path) for path, data in wanted.items() if _settle(layout, path, data))


def _settle(layout: Layout, path: Path, data: bytes | None) -> bool:
    """Make a file's content be `data`, or the file not be there; return whether that was work."""
    current = path.read_bytes() if path.is_file() else None
    if current == data:
        return False
    if data is None:
        remove(path)
        sync_folder(path.parent)
    else:
        replace(path, data, layout.staging)
    return True
