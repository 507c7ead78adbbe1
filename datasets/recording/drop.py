"""Rewriting a dataset without some of its episodes, whole at every moment; the others move up.

The new dataset is made beside the old one, `.NAME.partial`, and takes its name when it is finished and on the
disk. Cut short before that, nothing has changed; after it, `settle_drop` finishes what is left.
"""

import os
from collections.abc import Callable, Mapping
from pathlib import Path

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.columns import Scalar
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.manifest import Manifest, read_manifest
from handrail.datasets.format.metadata import Totals, info_bytes, read_encodings, read_record, stats_bytes
from handrail.datasets.format.tables import tasks_bytes
from handrail.datasets.recording.append import append_episode
from handrail.datasets.recording.checksums import Checksums
from handrail.datasets.recording.folder import check_folders
from handrail.datasets.recording.repair import tidy_locked
from handrail.datasets.storage.atomic import (
    explained,
    make_folder,
    publish_folder,
    remove,
    replace,
    sync_folder,
)
from handrail.datasets.storage.lock import DatasetLock

Dropped = Callable[[Mapping[str, Scalar | None]], bool]


def drop_episodes(root: str | Path, dropped: Dropped) -> int:
    """Remove episodes from a dataset that Handrail wrote, for good; return how many.

    Args:
        root: Its folder; removed too if no episode is left.
        dropped: Says by an episode's extra columns whether it goes.

    Raises:
        HandrailError: The dataset is not Handrail's, is damaged, in use, or has episodes that were set aside.
            Nothing has been removed then.
    """
    layout = Layout(Path(root).expanduser().absolute())
    with explained(f"cannot remove episodes from dataset {str(layout.root)!r}"):
        settle_drop(layout.root)
        manifest = read_manifest(layout)
        check_folders(layout)
        if layout.damaged.exists():
            raise HandrailError(
                f"dataset {str(layout.root)!r}: in {layout.damaged.name} are episodes that were set aside;"
                " some may have to go too: put them back with handrail-repair, or remove that folder"
            )
        lock = DatasetLock(layout.staging)
        try:
            return _drop(layout, manifest, dropped)
        finally:
            lock.release()


def settle_drop(root: Path) -> None:
    """Finish a removal of episodes that was cut short, if there was one.

    Raises:
        OSError: Something cannot be renamed or removed.
    """
    old, draft = _old(root), _draft(root)
    if old.exists():
        if not root.exists():
            os.replace(draft if draft.exists() else old, root)
            sync_folder(root.parent)
        remove(old)
    remove(draft)


def _drop(layout: Layout, manifest: Manifest, dropped: Dropped) -> int:
    _, totals = tidy_locked(layout, manifest, Checksums(layout.root, anew=True))
    records = [read_record(layout.row(number), with_stats=True) for number in range(totals.episodes)]
    kept = [record for record in records if not dropped(record.columns)]
    if len(kept) == len(records):
        return 0
    if not kept:
        os.replace(layout.root, _old(layout.root))
        sync_folder(layout.root.parent)
        remove(_old(layout.root))
        return len(records)
    draft = Layout(_draft(layout.root))
    make_folder(draft.staging)
    replace(draft.manifest, manifest.to_bytes(), draft.staging)
    left = Totals()
    for record in kept:
        left = left.grown(append_episode(draft, layout, manifest, record, left, ""))
    replace(draft.tasks, tasks_bytes(left.tasks), draft.staging)
    replace(draft.stats, stats_bytes(left.stats or {}), draft.staging)
    replace(draft.info, info_bytes(manifest, left, read_encodings(layout.info, manifest)), draft.staging)
    remove(draft.staging)
    publish_folder(draft.root, layout.root)
    return len(records) - len(kept)


def _draft(root: Path) -> Path:
    return root.with_name(f".{root.name}.partial")


def _old(root: Path) -> Path:
    return root.with_name(f".{root.name}.old")  # as `publish_folder` calls it
