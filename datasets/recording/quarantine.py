"""Episodes that are not whole, taken out of a dataset."""

from collections.abc import Iterator
from pathlib import Path

from handrail.datasets.format.episode_rows import EpisodeRows, read_column_types
from handrail.datasets.format.info_file import read_encodings
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import Totals
from handrail.datasets.format.schema import video_keys
from handrail.datasets.recording.rewrite import write_anew
from handrail.datasets.recording.slice import EpisodeSlice
from handrail.datasets.recording.survey import Survey


def without_damaged(found: Survey, manifest: Manifest) -> Totals:
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
