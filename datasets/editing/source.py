"""A dataset that episodes are taken from: one that Handrail recorded, whole."""

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.columns import ColumnTypes
from handrail.datasets.format.layout import Layout, episode_of
from handrail.datasets.format.lines import ForeignLineError, Lines, read_column_types, rows_of_lines
from handrail.datasets.format.manifest import Manifest, read_manifest
from handrail.datasets.format.metadata import read_encodings
from handrail.datasets.reading.check import check_whole
from handrail.datasets.reading.reader import DatasetInfo, read_episodes, read_info, with_success
from handrail.datasets.recording.folder import check_folders
from handrail.datasets.recording.piece import Piece
from handrail.datasets.recording.rewrite import Encodings


@dataclass(frozen=True)
class Source:
    """A dataset that was checked.

    Attributes:
        layout: Its paths.
        manifest: Its schema.
        types: Of its extra columns.
        encodings: How its videos are encoded, where that is not as Handrail does it.
        info: What it is.
        rows: Lines of metadata of its episodes, with `success` where that is known.
    """

    layout: Layout
    manifest: Manifest
    types: ColumnTypes
    encodings: Encodings
    info: DatasetInfo
    rows: Sequence[dict[str, Any]]

    @property
    def successes(self) -> list[bool | None]:
        """How every episode ended; None where that is not known."""
        return [None if (said := row.get("success")) is None else bool(said) for row in self.rows]

    @property
    def tasks(self) -> list[str]:
        """Its task sentences."""
        return list(dict.fromkeys(task for row in self.rows for task in row["tasks"]))

    @classmethod
    def open(cls, root: Path, verify: bool = False) -> "Source":
        """Check a dataset.

        Args:
            root: Its folder.
            verify: Read every byte anew.

        Raises:
            HandrailError: There is none, it is damaged or empty, or another tool wrote it.
        """
        info, layout = read_info(root), Layout(root)
        if not info.from_handrail:
            raise _foreign(root, "no meta/handrail.json")
        manifest = read_manifest(layout)
        check_folders(layout)
        check_whole(root, verify)
        rows = with_success(info, read_episodes(root))
        if not rows:
            raise HandrailError(f"dataset {str(root)!r}: expected an episode or more, found none")
        try:
            Lines.read(layout.row(0))
        except (ForeignLineError, FileNotFoundError) as error:
            raise _foreign(root, "its meta/episodes has been rewritten") from error
        types, encodings = read_column_types(layout.row(0)), read_encodings(layout.info, manifest)
        return cls(layout, manifest, types, encodings, info, rows)

    def pieces(self, numbers: Sequence[int] | None = None) -> Iterator[Piece]:
        """Yield episodes, one at a time; all of them without numbers.

        Raises:
            HandrailError: A line of metadata cannot be read.
        """
        slots = sorted(
            number for path in rows_of_lines(self.layout) if (number := episode_of(path)) is not None
        )
        lines: Lines | None = None
        for number in range(len(self.rows)) if numbers is None else numbers:
            slot = slots[bisect_right(slots, number) - 1]
            path = self.layout.row(slot)
            try:
                lines = lines if lines is not None and lines.path == path else Lines.read(path)
                record = lines.record(number - slot, with_stats=True)
            except (OSError, ValueError, KeyError, IndexError) as error:
                raise HandrailError(
                    f"{str(path)!r} cannot be read ({error}); the dataset is damaged"
                ) from error
            yield Piece.of(self.layout, self.manifest, record)


def _foreign(root: Path, why: str) -> HandrailError:
    return HandrailError(
        f"dataset {str(root)!r}: expected one that Handrail wrote, got another tool's ({why});"
        " lerobot-edit-dataset edits it"
    )
