"""Bringing a dataset that Handrail wrote back to its longest run of complete episodes.

An episode is complete if its line of metadata is there, follows on the one before, and its files have the
sizes (thorough: the SHA-256) that they had when it was saved. What a crash leaves behind (staged files, the
published files of the one episode that was never committed) is removed; anything that belonged to a saved
episode, or that nobody can explain, is moved into `.damaged/`, never deleted. `info.json`, `stats.json` and
`tasks.parquet` are then rebuilt if they are not, to the byte, what the episodes say.

    python -c "from handrail.datasets.repair import repair; print(repair('path/to/dataset'))"
"""

import json
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa

from handrail.datasets.atomic import explained, remove, replace, sync_folder
from handrail.datasets.folder import clear_staging, set_aside
from handrail.datasets.layout import Layout, episode_of
from handrail.datasets.lock import DatasetLock
from handrail.datasets.manifest import Manifest, read_manifest
from handrail.datasets.metadata import (
    EpisodeRecord,
    FileSeal,
    Totals,
    info_bytes,
    read_record,
    stats_bytes,
)
from handrail.datasets.schema import video_keys
from handrail.datasets.stats import Stats, stats_from_lists
from handrail.datasets.tables import tasks_bytes

_UNREADABLE = (OSError, pa.ArrowException, ValueError, KeyError, TypeError)


@dataclass(frozen=True)
class RepairReport:
    """What `repair` found and did; printing it gives one line a fact.

    Attributes:
        root: The dataset.
        episodes: Number of complete episodes kept.
        frames: Number of their frames.
        damage: What is wrong with the first episode that is not complete, or "".
        removed: Leftovers of an interrupted recording, deleted; paths in the dataset.
        moved: Files set aside in `.damaged/`; the paths that they had.
        rebuilt: Summary files written anew.
    """

    root: Path
    episodes: int
    frames: int
    damage: str = ""
    removed: tuple[str, ...] = ()
    moved: tuple[str, ...] = ()
    rebuilt: tuple[str, ...] = ()

    @property
    def clean(self) -> bool:
        """Whether there was nothing to do."""
        return not (self.damage or self.removed or self.moved or self.rebuilt)

    def __str__(self) -> str:
        lines = [f"dataset {str(self.root)!r}: {self.episodes} complete episodes, {self.frames} frames"]
        lines += [f"damage: {self.damage}"] if self.damage else []
        for name in ("removed", "moved", "rebuilt"):
            paths = getattr(self, name)
            where = " to .damaged/" if name == "moved" else ""
            lines += [f"{name}{where}: {', '.join(paths)}"] if paths else []
        return "\n".join(lines if not self.clean else [f"{lines[0]}; nothing to repair"])


def repair(root: str | Path, thorough: bool = True) -> RepairReport:
    """Repair a dataset; doing it twice changes nothing more.

    Args:
        root: The dataset's folder.
        thorough: Whether to hash every file (about 1 GB/s) rather than compare sizes only.

    Raises:
        HandrailError: No dataset, another tool's, one that another tool has appended to, or one being
            written. Nothing has been changed then.
    """
    layout = Layout(Path(root).expanduser().absolute())
    manifest = read_manifest(layout)
    with explained(f"cannot repair dataset {str(layout.root)!r}"):
        lock = DatasetLock(layout.staging)
        try:
            return repair_locked(layout, manifest, thorough)[0]
        finally:
            lock.release()


def repair_locked(layout: Layout, manifest: Manifest, thorough: bool) -> tuple[RepairReport, Totals]:
    """Repair a dataset whose lock the caller holds, and return also what its episodes add up to.

    Raises:
        HandrailError: Another tool has appended to the dataset.
        OSError: A file cannot be moved, removed or written.
    """
    records, damage = _complete_episodes(layout, manifest, thorough)
    leftovers, doubtful = _other_files(layout, len(records))
    damage = damage or _gap(layout, len(records), doubtful)
    removed = clear_staging(layout) + _remove_all(layout, leftovers)
    moved = set_aside(layout, doubtful)
    totals, rebuilt = _rebuild(layout, manifest, records, thorough)
    report = RepairReport(
        layout.root, totals.episodes, totals.frames, damage, tuple(removed), tuple(moved), tuple(rebuilt)
    )
    return report, totals


def _complete_episodes(layout: Layout, manifest: Manifest, thorough: bool) -> tuple[list[EpisodeRecord], str]:
    """Return the longest run of complete episodes, and what is wrong with the next one, if anything."""
    records: list[EpisodeRecord] = []
    start = 0
    while (path := layout.row(len(records))).exists():
        try:
            record = read_record(path, with_stats=False)
        except _UNREADABLE as error:
            return records, f"{layout.relative(path)} cannot be read ({_first_line(error)})"
        damage = _damage(layout, manifest, record, (len(records), start), thorough)
        if damage:
            return records, damage
        records.append(record)
        start += record.length
    return records, ""


def _damage(
    layout: Layout, manifest: Manifest, record: EpisodeRecord, place: tuple[int, int], thorough: bool
) -> str:
    """Return what is wrong with an episode, or ""."""
    episode, start = place
    if (record.episode, record.start) != place or record.length < 1:
        return (
            f"{layout.relative(layout.row(episode))} is not the line of episode {episode}, frame {start} on"
        )
    expected = {layout.data(episode), *(layout.video(key, episode) for key in video_keys(manifest.features))}
    if {layout.root / path for path in record.files} != expected:
        return f"{layout.relative(layout.row(episode))} names files that are not those of episode {episode}"
    faults = (_file_damage(layout.root / path, path, seal, thorough) for path, seal in record.files.items())
    return next((fault for fault in faults if fault), "")


def _file_damage(path: Path, name: str, seal: FileSeal, thorough: bool) -> str:
    if not path.is_file():
        return f"{name} is missing"
    size = path.stat().st_size
    if size != seal.size:
        return f"{name} has {size} bytes, expected {seal.size}"
    return f"{name} has other content than was saved" if thorough and FileSeal.of(path) != seal else ""


def _other_files(layout: Layout, kept: int) -> tuple[list[Path], list[Path]]:
    """Return the files of no complete episode: leftovers of a crash, and those to be set aside.

    A crash leaves files of one episode only, the next one, without its line of metadata. Anything beyond
    it, any line of metadata, and a count in `info.json` that says more were saved, make all of them doubtful.
    Lines of metadata come last, so that moving them may be cut short at any place and done again.
    """
    patterns = ("videos/*/*/*.mp4", "data/*/*.parquet")
    streams = [path for pattern in patterns for path in sorted(layout.root.glob(pattern))]
    others = [path for path in streams if _is_beyond(path, kept)]
    rows = [path for path in sorted(layout.root.glob("meta/episodes/*/*.parquet")) if _is_beyond(path, kept)]
    expected = not rows and _saved_in_info(layout) <= kept
    if expected and all(episode_of(path) == kept for path in others):
        return others, []
    return [], others + rows[::-1]


def _gap(layout: Layout, kept: int, doubtful: list[Path]) -> str:
    """Return why a run ends although none of its episodes is damaged: a line or a file out of place."""
    if any(episode_of(path) is None for path in doubtful):
        stray = next(path for path in doubtful if episode_of(path) is None)
        return f"{layout.relative(stray)} is no file of a LeRobot dataset"
    counted = _saved_in_info(layout)
    if doubtful or counted > kept:
        said = f"; info.json counts {counted} episodes" if counted > kept else ""
        return f"{layout.relative(layout.row(kept))} is missing{said}"
    return ""


def _is_beyond(path: Path, kept: int) -> bool:
    episode = episode_of(path)
    return episode is None or episode >= kept


def _saved_in_info(layout: Layout) -> int:
    """Return how many episodes `info.json` says there are; 0 if it cannot be read."""
    try:
        return int(json.loads(layout.info.read_bytes())["total_episodes"])
    except _UNREADABLE:
        return 0


def _remove_all(layout: Layout, paths: list[Path]) -> list[str]:
    for path in paths:
        remove(path)
    for folder in {path.parent for path in paths}:
        sync_folder(folder)
    return [layout.relative(path) for path in paths]


def _rebuild(
    layout: Layout, manifest: Manifest, records: list[EpisodeRecord], thorough: bool
) -> tuple[Totals, list[str]]:
    """Write the summary files that are not what the episodes say."""
    totals = Totals()
    for record in records:
        totals = totals.grown(record)
    trusted = None if thorough else _trusted_stats(layout, totals)
    stats = trusted or _folded_stats(layout, len(records))
    totals = Totals(totals.episodes, totals.frames, totals.tasks, stats)
    wanted = {
        layout.tasks: tasks_bytes(totals.tasks) if totals.tasks else None,
        layout.stats: stats_bytes(stats) if stats else None,
        layout.info: info_bytes(manifest, totals),
    }
    return totals, [layout.relative(path) for path, data in wanted.items() if _settle(layout, path, data)]


def _trusted_stats(layout: Layout, totals: Totals) -> Stats | None:
    """Return the statistics on the disk if they are of exactly these frames: saves reading every line."""
    try:
        stats = stats_from_lists(json.loads(layout.stats.read_bytes()))
        return stats if int(stats["index"]["count"][0]) == totals.frames else None
    except _UNREADABLE:
        return None


def _folded_stats(layout: Layout, count: int) -> Stats | None:
    totals = Totals()
    for episode in range(count):
        totals = totals.grown(read_record(layout.row(episode), with_stats=True))
    return totals.stats


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


def _first_line(error: Exception) -> str:
    return str(error).partition("\n")[0]
