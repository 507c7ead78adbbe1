"""A dataset that episodes are taken from: one that Handrail recorded, whole."""

import shlex
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.episode_rows import EpisodeRows, ForeignRowError, read_column_types, row_files
from handrail.datasets.format.info_file import Encodings, read_encodings
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.manifest import Manifest, read_manifest
from handrail.datasets.format.metadata import ColumnTypes
from handrail.datasets.reading.check import check_whole
from handrail.datasets.reading.reader import DatasetInfo, read_episodes, read_info, with_success
from handrail.datasets.recording.checksums import Checksums
from handrail.datasets.recording.folder import check_folders
from handrail.datasets.recording.repair import tidy_locked
from handrail.datasets.recording.rewrite import settle
from handrail.datasets.recording.slice import EpisodeSlice
from handrail.datasets.storage.atomic import explained
from handrail.datasets.storage.lock import FolderLock


@dataclass(frozen=True)
class EditSource:
    """A dataset that was checked."""

    layout: Layout
    manifest: Manifest
    types: ColumnTypes
    """Of its extra columns."""
    encodings: Encodings
    """How its videos are encoded, where that is not as Handrail does it."""
    info: DatasetInfo

    @classmethod
    def open(cls, root: Path, verify: bool = False) -> "EditSource":
        """Check a dataset; with `verify`, read every byte anew."""
        info, layout = read_info(root), Layout(root)
        foreign = (
            f"dataset {str(root)!r}: expected one that Handrail wrote, got another tool's;"
            " lerobot-edit-dataset edits it"
        )
        if not info.from_handrail:
            raise HandrailError(foreign)
        manifest = read_manifest(layout)
        check_folders(layout)
        check_whole(root, verify)
        rows = row_files(layout)
        if not rows:
            raise HandrailError(f"dataset {str(root)!r}: expected an episode or more, found none")
        try:
            EpisodeRows.read(rows[0])
        except (ForeignRowError, FileNotFoundError) as error:
            raise HandrailError(foreign) from error
        return cls(layout, manifest, read_column_types(rows[0]), read_encodings(layout, manifest), info)

    @cached_property
    def rows(self) -> Sequence[dict[str, Any]]:
        """Rows of metadata of its episodes, with `success` where that is known."""
        return with_success(self.info, read_episodes(self.layout.root))

    @property
    def successes(self) -> list[bool | None]:
        """How every episode ended; None where that is not known."""
        return [None if (said := row.get("success")) is None else bool(said) for row in self.rows]

    def slices(self, numbers: Collection[int] | None = None) -> Iterator[EpisodeSlice]:
        """Yield episodes in their order, one at a time; all of them without numbers."""
        for path in row_files(self.layout):
            try:
                rows = EpisodeRows.read(path)
                for place, row in enumerate(rows.rows):
                    if numbers is None or row["episode_index"] in numbers:
                        record = rows.record(place, with_stats=True)
                        yield EpisodeSlice.of(self.layout, self.manifest, record)
            except (OSError, ValueError, KeyError, IndexError) as error:
                raise HandrailError(
                    f"{str(path)!r} cannot be read ({error}); the dataset is damaged"
                ) from error


def check_none_set_aside(layout: Layout) -> None:
    """Check that nothing lies in a dataset's quarantine."""
    if layout.damaged.exists():
        raise HandrailError(
            f"dataset {str(layout.root)!r}: in {layout.damaged.name} are episodes that were set aside,"
            " or files of none, which the edit does not see: move that folder elsewhere first"
        )


@contextmanager
def opened(roots: Sequence[Path], target: Path, verify: bool = False) -> Iterator[list[EditSource]]:
    """Provide datasets whose episodes go to a target, which nobody else writes if it is one of them."""
    with explained(f"cannot write {str(target)!r}"):
        if settle(target):
            raise HandrailError(
                f"dataset {str(target)!r}: an edit was cut short, and is finished now; look at it"
                f" (handrail-inspect {shlex.quote(str(target))}) before the next"
            )
        if target not in roots:
            if target.exists() and (not target.is_dir() or any(target.iterdir())):
                raise HandrailError(f"--output {target}: expected a missing or empty folder, got one in use")
            yield [EditSource.open(root, verify) for root in roots]
            return
        EditSource.open(target)
        with FolderLock(Layout(target).staging, existing=True):
            own = EditSource.open(target)  # again: another edit may have been faster
            tidy_locked(own.layout, own.manifest, Checksums(target, anew=verify))
            check_none_set_aside(own.layout)
            yield [own if root == target else EditSource.open(root, verify) for root in roots]
