"""Datasets from episodes of others, in files of many episodes, in one pass: every edit is such a copy."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any

import pyarrow as pa

from handrail.controllers.errors import HandrailError
from handrail.datasets.editing.source import EditSource, check_none_set_aside, opened
from handrail.datasets.format.episode_rows import row_files
from handrail.datasets.format.info_file import Encodings
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import ColumnTypes
from handrail.datasets.format.schema import Feature
from handrail.datasets.recording.frames import shared_features
from handrail.datasets.recording.rewrite import left_of, rename_away, settle, write_anew
from handrail.datasets.recording.slice import EpisodeSlice
from handrail.datasets.storage.atomic import explained, followed
from handrail.datasets.storage.lock import FolderLock
from handrail.datasets.storage.strict_json import known_json

_NEEDED = ("video.codec", "video.pix_fmt")  # in which all videos of a camera have to agree


@dataclass(frozen=True)
class Edited:
    """A dataset that was written."""

    root: Path
    episodes: int
    frames: int
    before: int
    """Number of frames of the datasets that it came from."""

    def __str__(self) -> str:
        words = f"{self.root}: {self.episodes} episodes, {self.frames} frames (of {self.before})"
        return "; ".join(filter(None, (words, left_of(self.root))))


def copy_episodes(
    sources: Sequence[EditSource],
    target: Path,
    slices: Iterable[EpisodeSlice] | None = None,
    name: str = "",
    in_place: bool = False,
    types: ColumnTypes | None = None,
) -> Edited:
    """Write episodes of datasets as one dataset with files of many episodes.

    Args:
        sources: The datasets.
        target: Folder of the new dataset.
        slices: The episodes, in order; all of the sources' without.
        name: Of the new dataset, `owner/name`; that of the first source when empty.
        in_place: Whether it replaces one of the sources.
        types: Of the extra columns, where they are not those of all sources.
    """
    first, found = sources[0], (shared_features(source.manifest.features) for source in sources)
    shared = next(filter(None, found), {})  # a demonstration has them, too, once it lies beside a take-over
    manifest = _with(shared, first.manifest)
    for other in sources[1:]:
        _with(shared, other.manifest).check_fits(manifest, _refused(other, first))
    manifest = replace(manifest, repo_id=name or first.manifest.repo_id)
    manifest.check()
    if slices is None:
        slices = chain.from_iterable(source.slices() for source in sources)
    types = types or _merged_types(sources)
    totals = write_anew(target, manifest, slices, types, _merged_encodings(sources), in_place)
    return Edited(target, totals.episodes, totals.frames, sum(source.info.frames for source in sources))


def merge_datasets(
    roots: Sequence[str | Path], output: str | Path, name: str = "", verify: bool = False
) -> Edited:
    """Write the episodes of datasets, in their order, as one dataset with files of many episodes.

    Args:
        roots: Their folders, one or more; some of several may have no episode yet.
        output: Folder of the new dataset, missing or empty; or one of `roots`, which is replaced at once when
            the new dataset is whole.
        name: Of the new dataset, `owner/name`; that of the first folder when empty.
        verify: Read every file of the datasets anew, also those that have not changed since the last check.
    """
    target, *given = map(followed, (output, *roots))
    if twice := [str(root) for root in given if given.count(root) > 1]:
        raise HandrailError(f"merge: expected each folder once, got {twice[0]!r} twice")
    places = [root for root in given if root == target or not _is_empty(root)] or given
    with opened(places, target, verify) as sources:
        return copy_episodes(sources, target, name=name, in_place=target in places)


def drop_episodes(root: str | Path, dropped: Callable[[Mapping[str, Any]], bool]) -> int:
    """Remove episodes from a dataset that Handrail wrote, for good; return how many.

    Args:
        root: Its folder; removed too if no episode is left.
        dropped: Says by an episode's row of metadata whether it goes.
    """
    root = followed(root)
    count, cannot = 0, f"cannot write {str(root)!r}"
    with explained(cannot):
        _settle_all(root)  # what was cut short is done; dropping the same again does no harm
        if empty := _is_empty(root):
            with FolderLock(Layout(root).staging):
                check_none_set_aside(Layout(root))
                rename_away(root)  # files of a first episode that was cut short may lie there
    if not empty:
        with opened([root], root, verify=True) as (source,):
            kept = [row["episode_index"] for row in source.rows if not dropped(row)]
            count = len(source.rows) - len(kept)
            if kept and count:
                copy_episodes([source], root, source.slices(kept), in_place=True)
            elif not kept:
                rename_away(root)
    with explained(cannot):
        _settle_all(root)
    return count


def _with(shared: Mapping[str, Feature], manifest: Manifest) -> Manifest:
    """Return a schema with those shared columns that it lacks."""
    lacking = {name: each for name, each in shared.items() if name not in manifest.features}
    return replace(manifest, features={**manifest.features, **lacking})


def _settle_all(root: Path) -> None:
    """Finish a writing anew that was cut short, and check that it left no episode."""
    settle(root)
    if left := left_of(root):
        raise HandrailError(f"{left}, then do it again")


def _is_empty(root: Path) -> bool:
    """Return whether a dataset was begun, and nothing has been recorded."""
    layout = Layout(root)
    counted = known_json(layout.info).get("total_episodes")  # of one that was copied in part
    return layout.manifest.is_file() and not (row_files(layout) or counted)


def _refused(other: EditSource, first: EditSource) -> str:
    return f"merge: cannot add {str(other.layout.root)!r} to {str(first.layout.root)!r}"


def _merged_types(sources: Sequence[EditSource]) -> ColumnTypes:
    """Return the extra columns that any of them has."""
    found: ColumnTypes = {}
    for source in sources:
        for name, kind in source.types.items():
            before = found.setdefault(name, kind)
            if before != kind and {before, kind} == {pa.int64(), pa.float64()}:
                found[name] = pa.float64()
            elif before != kind:
                said = f"its episode column {name!r} is {kind}, expected {before}"
                raise HandrailError(f"{_refused(source, sources[0])}: {said}")
    return found


def _merged_encodings(sources: Sequence[EditSource]) -> Encodings:
    """Return how all videos are encoded: what they agree in; nothing where Handrail alone encoded them."""
    found = dict(sources[0].encodings)
    for source in sources[1:]:
        for key, encoding in source.encodings.items():
            mine = found.setdefault(key, encoding)
            for name in _NEEDED:
                if mine.get(name) != encoding.get(name):
                    said = f"its {name} of {key!r} is {encoding.get(name)}, expected {mine.get(name)}"
                    raise HandrailError(f"{_refused(source, sources[0])}: {said}")
            found[key] = {name: value for name, value in mine.items() if encoding.get(name) == value}
    return found
