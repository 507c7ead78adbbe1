"""Rewriting a dataset without some of its episodes, whole at every moment; the others move up."""

from collections.abc import Callable, Mapping
from pathlib import Path

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.columns import Scalar
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.lines import each_line, read_column_types
from handrail.datasets.format.manifest import Manifest, read_manifest
from handrail.datasets.format.metadata import read_encodings
from handrail.datasets.recording.checksums import Checksums
from handrail.datasets.recording.folder import check_folders
from handrail.datasets.recording.piece import Piece
from handrail.datasets.recording.repair import tidy_locked
from handrail.datasets.recording.rewrite import remove_whole, settle, write_anew
from handrail.datasets.storage.atomic import explained
from handrail.datasets.storage.lock import DatasetLock

Dropped = Callable[[Mapping[str, Scalar | None]], bool]


def drop_episodes(root: str | Path, dropped: Dropped) -> int:
    """Remove episodes from a dataset that Handrail wrote, for good; return how many.

    Args:
        root: Its folder; removed too if no episode is left.
        dropped: Says by an episode's extra columns whether it goes.
    """
    layout = Layout(Path(root).expanduser().absolute())
    with explained(f"cannot remove episodes from dataset {str(layout.root)!r}"):
        settle(layout.root)
        manifest = read_manifest(layout)
        check_folders(layout)
        check_nothing_set_aside(layout)
        lock = DatasetLock(layout.staging)
        try:
            return _drop(layout, manifest, dropped)
        finally:
            lock.release()


def check_nothing_set_aside(layout: Layout) -> None:
    """Check that a dataset that is written anew has no episodes in `.damaged/`."""
    if layout.damaged.exists():
        raise HandrailError(
            f"dataset {str(layout.root)!r}: in {layout.damaged.name} are episodes that were set aside;"
            " some may have to go too: remove that folder"
        )


def _drop(layout: Layout, manifest: Manifest, dropped: Dropped) -> int:
    _, totals = tidy_locked(layout, manifest, Checksums(layout.root, anew=True))
    kept = {record.episode for record in each_line(layout) if not dropped(record.columns)}
    if len(kept) == totals.episodes:
        return 0
    if not kept:
        remove_whole(layout.root)
        return totals.episodes
    records = (record for record in each_line(layout, with_stats=True) if record.episode in kept)
    pieces = (Piece.of(layout, manifest, record) for record in records)
    types, encodings = read_column_types(layout.row(0)), read_encodings(layout.info, manifest)
    write_anew(layout.root, manifest, pieces, types, encodings, in_place=True)
    return totals.episodes - len(kept)
