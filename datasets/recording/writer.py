"""Writing a LeRobot v3.0 dataset so that a crash loses at most the episode being recorded.

Every file of an episode is written in `.handrail/` inside the dataset and synced; only when all are whole
are they renamed into place: videos, data, tasks, then **the episode's row of metadata, which is the
commit**, then `info.json` and `stats.json`. A disk that fills up is noticed before the first rename.

    with EpisodeWriter.create(root, Manifest("me/cups", 50, "ridgeback_ur10", features)) as writer:
        writer.add_frame({"observation.state": state, "action": action}, task="lift the cup")
        writer.save_episode({"success": True, "operator": "ada"})
"""

import contextlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.episode_rows import read_column_types, row_files, rows_bytes
from handrail.datasets.format.info_file import info_bytes, read_encodings, summary_files
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.manifest import Manifest, read_manifest
from handrail.datasets.format.metadata import (
    Checksum,
    ColumnTypes,
    EpisodeRecord,
    Scalar,
    Totals,
    column_types,
    fit_columns,
    plain_columns,
)
from handrail.datasets.format.schema import video_keys
from handrail.datasets.format.tables import data_bytes
from handrail.datasets.recording.checksums import Checksums
from handrail.datasets.recording.episode import OpenEpisode
from handrail.datasets.recording.folder import check_folders, check_target, clear_dataset, clear_staging
from handrail.datasets.recording.repair import RepairReport, tidy_locked
from handrail.datasets.recording.rewrite import settle
from handrail.datasets.storage.atomic import (
    explained,
    followed,
    make_folder,
    move,
    reason,
    remove,
    sync,
    write_synced,
    write_whole,
)
from handrail.datasets.storage.lock import FolderLock


class EpisodeWriter:
    """Adds episodes to one dataset; get one from `create` or `resume`, close it, or use it in a `with`.

    Every error is a `HandrailError` with one line. After an error in `add_frame` the frame is not in. After
    one in `save_episode` the saved episodes are whole, and the next may be recorded; this one is gone, but
    where its columns were refused: then it is still open, to be saved with others, or discarded.
    """

    def __init__(
        self,
        layout: Layout,
        manifest: Manifest,
        totals: Totals,
        lock: FolderLock,
        types: ColumnTypes | None,
        repaired: RepairReport | None = None,
    ):
        """Use `create` or `resume` instead."""
        self._layout, self._manifest, self._totals = layout, manifest, totals
        self._lock, self._types, self._unusable = lock, types, ""
        self._episode, self._encodings = OpenEpisode(layout, manifest), read_encodings(layout, manifest)
        self.root = layout.root
        """The dataset's folder."""
        self.features = manifest.features
        """The columns that each frame must have."""
        self.repaired = repaired
        """What `resume` put in order."""

    @classmethod
    def create(
        cls, root: str | Path, manifest: Manifest, overwrite: bool = False, types: ColumnTypes | None = None
    ) -> Self:
        """Start a new dataset.

        Args:
            root: Its folder; must be missing or empty.
            manifest: Its schema; LeRobot's own columns (timestamp, indices) are added.
            overwrite: Remove the dataset that Handrail recorded there. Anything else is never removed.
            types: Of the extra columns; the first episode fixes them without.
        """
        layout = Layout(followed(root))
        manifest.check()
        with explained(f"cannot create dataset {str(layout.root)!r}"), contextlib.ExitStack() as on_error:
            settle(layout.root)
            check_target(layout, overwrite)
            lock = on_error.enter_context(FolderLock(layout.staging))
            settle(layout.root)  # again: an edit may have begun, and would have no dataset between its names
            check_target(layout, overwrite)  # and another recorder may have been faster
            clear_dataset(layout)
            write_whole(layout.manifest, manifest.to_bytes(), layout.staging)
            write_whole(layout.info, info_bytes(manifest, Totals()), layout.staging)
            on_error.pop_all()
        return cls(layout, manifest, Totals(), lock, types)

    @classmethod
    def resume(cls, root: str | Path, manifest: Manifest, verify: bool = False) -> Self:
        """Go on with a dataset that Handrail wrote; what a crash left is cleared first, see `repaired`.

        Args:
            root: Its folder.
            manifest: The schema, which must be the dataset's but for its name; the versions are of this
                session and are kept with each of its episodes.
            verify: Read every file anew, also those that have not changed since they were last checked.
        """
        layout = Layout(followed(root))
        words = f"--resume: cannot add to dataset {str(layout.root)!r}"
        with explained(words), contextlib.ExitStack() as on_error:
            settle(layout.root)
            read_manifest(layout)
            manifest.check()
            check_folders(layout)
            lock = on_error.enter_context(FolderLock(layout.staging, existing=True))
            existing = read_manifest(layout)  # again: an edit may have been faster
            manifest.check_fits(existing, words)
            report, totals = tidy_locked(layout, existing, Checksums(layout.root, anew=verify))
            types = read_column_types(row_files(layout)[-1]) if totals.episodes else None
            on_error.pop_all()
        return cls(layout, manifest, totals, lock, types, report)

    @property
    def staging(self) -> Path:
        """The folder of files that are not published yet, inside the dataset."""
        return self._layout.staging

    @property
    def num_episodes(self) -> int:
        """Number of saved episodes."""
        return self._totals.episodes

    @property
    def num_frames(self) -> int:
        """Number of frames in the saved episodes."""
        return self._totals.frames

    @property
    def open_frames(self) -> int:
        """Number of frames in the episode being recorded."""
        return self._episode.length

    def add_frame(self, frame: Mapping[str, Any], task: str) -> None:
        """Add one frame to the open episode.

        Args:
            frame: A value for every feature, copied; see `schema.check_frame`.
            task: The task, in words.
        """
        self._check_usable()
        self._episode.add(frame, task)

    def has_column(self, name: str) -> bool:
        """Whether an episode may have an extra column: the first one fixes which there are."""
        return self._types is None or name in self._types

    def save_episode(self, columns: Mapping[str, Scalar | None] | None = None) -> int:
        """Save the open episode and return its number; it survives a crash and a power failure from then on.

        Args:
            columns: Of the episode's metadata, such as success; the first episode fixes which there are.
        """
        self._check_usable()
        number = self.num_episodes
        if not self._episode.length:
            raise HandrailError(f"episode {number}: expected at least one frame, got none")
        versions = json.dumps(dict(self._manifest.versions), sort_keys=True)
        extras = plain_columns({"versions": versions, **(columns or {})})
        types = self._types or column_types(extras)
        extras = fit_columns(extras, types)
        self._unusable = "was interrupted while it saved an episode"  # until the state is known again
        try:
            totals = self._stage(extras, types)
            self._publish(totals)
        except (OSError, HandrailError, ValueError, OverflowError) as error:  # a text that is none
            with contextlib.suppress(OSError):  # the next save overwrites leftovers, `repair` removes them
                for _, path in self._streams():
                    remove(path)
                self._discard()
            self._unusable = ""
            raise HandrailError(
                f"episode {number} in {str(self.root)!r} could not be saved: {reason(error)}; the {number}"
                " saved episodes are whole"
            ) from error
        self._types, self._totals = types, totals
        self._episode = OpenEpisode(self._layout, self._manifest)
        self._unusable = ""
        with explained(f"episode {number} is saved, but the summary files are late; `repair` rebuilds them"):
            sync(self._layout.row(number).parent)
            for path in (self._layout.info, self._layout.stats):
                os.replace(self._layout.staging / path.name, path)
            sync(self._layout.info.parent)
        return number

    def discard_episode(self) -> None:
        """Forget the open episode; nothing of it stays on the disk."""
        self._check_usable()
        self._discard()

    def erase_if_empty(self) -> None:
        """Remove the dataset if it has no episode; one whose saving was interrupted is left for `resume`.

        One with episodes that were set aside, or with files of others, stays too.
        """
        foreign = self._layout.foreign(self.features)
        if self.num_episodes or self._unusable or self._layout.damaged.exists() or foreign:
            return
        with explained(f"cannot remove the empty dataset {str(self.root)!r}"):
            self._discard()
            clear_dataset(self._layout)
            remove(self._layout.manifest)
            with contextlib.suppress(OSError):  # something else is in it
                self._layout.manifest.parent.rmdir()

    def close(self) -> None:
        """Forget the open episode, remove the temporary files, give the dataset free. Safe to call twice."""
        if self._unusable == "is closed":
            return
        with contextlib.suppress(OSError):  # the next `resume` or `repair` removes what is left
            self._discard()
        self._unusable = "is closed"
        with explained(f"cannot close dataset {str(self.root)!r}"):
            self._lock.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _stage(self, extras: Mapping[str, Scalar | None], types: ColumnTypes) -> Totals:
        """Write every file under its temporary name, only renames are left to do; return the totals then."""
        staging, episode, features = self._layout.staging, self._episode, self._manifest.features
        columns, stats = episode.finish(self._totals)
        write_synced(staging / "data.parquet", data_bytes(features, columns))
        record = EpisodeRecord(
            episode=self.num_episodes,
            start=self.num_frames,
            length=episode.length,
            tasks=tuple(dict.fromkeys(episode.tasks)),
            stats=stats,
            columns=extras,
            files={self._layout.relative(path): Checksum.of(staged) for staged, path in self._streams()},
            file_index=self.num_episodes,
        )
        totals = self._totals.grown(record)
        write_synced(staging / "row.parquet", rows_bytes(self._manifest, [record], types))
        for path, data in summary_files(self._layout, self._manifest, totals, self._encodings).items():
            write_synced(staging / path.name, data or b"")
        for path in (self._layout.row(self.num_episodes), *(path for _, path in self._streams())):
            make_folder(path.parent)
        return totals

    def _streams(self) -> list[tuple[Path, Path]]:
        """Return the staged and the final path of each video and of the data."""
        number, keys = self.num_episodes, video_keys(self._manifest.features)
        videos = [(self._episode.staged_video(key), self._layout.video(key, number)) for key in keys]
        return [*videos, (self._layout.staging / "data.parquet", self._layout.data(number))]

    def _publish(self, totals: Totals) -> None:
        """Rename the files into place; the last rename is the commit."""
        for staged, path in self._streams():
            move(staged, path)
        if totals.tasks != self._totals.tasks:
            move(self._layout.staging / "tasks.parquet", self._layout.tasks)
        os.replace(self._layout.staging / "row.parquet", self._layout.row(self.num_episodes))

    def _discard(self) -> None:
        self._episode.cancel()
        self._episode = OpenEpisode(self._layout, self._manifest)
        clear_staging(self._layout)

    def _check_usable(self) -> None:
        if self._unusable:
            why = f"{self._unusable}: open the dataset again with --resume"
            raise HandrailError(f"writer of {str(self.root)!r} {why}")
