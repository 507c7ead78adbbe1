"""A dataset that episodes are taken from: one that Handrail recorded, whole."""

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from pathlib import Path
from typing import Any

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.episode_rows import EpisodeRows, ForeignRowError, read_column_types, row_files
from handrail.datasets.format.info_file import Encodings, read_encodings
from handrail.datasets.format.layout import Layout, episode_of
from handrail.datasets.format.manifest import Manifest, read_manifest
from handrail.datasets.format.metadata import ColumnTypes
from handrail.datasets.reading.check import check_whole
from handrail.datasets.reading.reader import DatasetInfo, read_episodes, read_info, with_success
from handrail.datasets.recording.folder import check_folders
from handrail.datasets.recording.slice import EpisodeSlice


@dataclass(frozen=True)
class EditSource:
    """A dataset that was checked.

    Attributes:
        layout: Its paths.
        manifest: Its schema.
        types: Of its extra columns.
        encodings: How its videos are encoded, where that is not as Handrail does it.
        info: What it is.
    """

    layout: Layout
    manifest: Manifest
    types: ColumnTypes
    encodings: Encodings
    info: DatasetInfo

    @cached_property
    def rows(self) -> Sequence[dict[str, Any]]:
        """EpisodeRows of metadata of its episodes, with `success` where that is known."""
        return with_success(self.info, read_episodes(self.layout.root))

    @property
    def successes(self) -> list[bool | None]:
        """How every episode ended; None where that is not known."""
        return [None if (said := row.get("success")) is None else bool(said) for row in self.rows]

    @property
    def tasks(self) -> list[str]:
        """Its task sentences."""
        return list(dict.fromkeys(task for row in self.rows for task in row["tasks"]))

    @classmethod
    def open(cls, root: Path, verify: bool = False) -> "EditSource":
        """Check a dataset.

        Args:
            root: Its folder.
            verify: Read every byte anew.
        """
        info, layout = read_info(root), Layout(root)
        if not info.from_handrail:
            raise _foreign(root, "no meta/handrail.json")
        manifest = read_manifest(layout)
        check_folders(layout)
        check_whole(root, verify)
        lines = row_files(layout)
        if not lines:
            raise HandrailError(f"dataset {str(root)!r}: expected an episode or more, found none")
        try:
            EpisodeRows.read(lines[0])
        except (ForeignRowError, FileNotFoundError) as error:
            raise _foreign(root, "its meta/episodes has been rewritten") from error
        types, encodings = read_column_types(lines[0]), read_encodings(layout, manifest)
        return cls(layout, manifest, types, encodings, info)

    def slices(self, numbers: Sequence[int] | None = None) -> Iterator[EpisodeSlice]:
        """Yield episodes, one at a time; all of them without numbers."""
        files = row_files(self.layout)
        if numbers is None:
            for path in files:
                yield from self._slices(path)
            return
        slots = sorted(number for path in files if (number := episode_of(path)) is not None)
        for slot, some in groupby(numbers, key=lambda number: slots[bisect_right(slots, number) - 1]):
            yield from self._slices(self.layout.row(slot), [number - slot for number in some])

    def _slices(self, path: Path, places: Sequence[int] | None = None) -> Iterator[EpisodeSlice]:
        """Yield the episodes of a volume."""
        try:
            lines = EpisodeRows.read(path)
            for place in range(len(lines)) if places is None else places:
                yield EpisodeSlice.of(self.layout, self.manifest, lines.record(place, with_stats=True))
        except (OSError, ValueError, KeyError, IndexError) as error:
            raise HandrailError(f"{str(path)!r} cannot be read ({error}); the dataset is damaged") from error


def _foreign(root: Path, why: str) -> HandrailError:
    return HandrailError(
        f"dataset {str(root)!r}: expected one that Handrail wrote, got another tool's ({why});"
        " lerobot-edit-dataset edits it"
    )
