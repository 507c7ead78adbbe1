"""Checking a dataset before it is used: is everything there that was saved, and is it what was saved?"""

import math
import os
import shlex
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import pyarrow as pa
import pyarrow.parquet as pq

from handrail.controllers.errors import HandrailError, first_line, restated
from handrail.controllers.regular_file import read_regular, regular
from handrail.datasets.format.episode_rows import ForeignRowError
from handrail.datasets.format.info_file import read_encodings, summary_files
from handrail.datasets.format.layout import FOLDERS, Layout
from handrail.datasets.format.manifest import read_manifest
from handrail.datasets.format.schema import AUTOMATIC, features_of, video_keys
from handrail.datasets.format.tables import UNREADABLE
from handrail.datasets.reading.digest import digest_of_pictures
from handrail.datasets.reading.reader import DatasetInfo, open_dataset, read_episodes, read_info
from handrail.datasets.recording.checksums import Checksums
from handrail.datasets.recording.survey import Survey, shortened, survey
from handrail.datasets.storage.atomic import explained
from handrail.datasets.storage.strict_json import MOST_BYTES, parse_json

_ROUNDING = 1e-6


def check_whole(root: str | Path, verify: bool = False) -> None:
    """Check a dataset that is to be learnt from or compared; cheap where nothing has changed since.

    Args:
        root: Its folder; any LeRobot v3.0 dataset.
        verify: Read every byte anew.
    """
    info, found = _surveyed(root, verify)
    where = f"dataset {str(info.root)!r}"
    if found is not None:
        found.require_whole()
        repair = f"handrail-edit repair {shlex.quote(str(info.root))}"
        manifest = read_manifest(found.layout)
        recorded = {key: feature for key, feature in info.features.items() if key not in AUTOMATIC}
        said = replace(manifest, fps=info.fps, robot_type=info.robot_type, features=recorded)
        said.check_fits(manifest, f"{where}: meta/info.json was changed; {repair} writes it anew")
        if stray := [found.layout.relative(each) for each in found.unknown if each.suffix == ".parquet"]:
            raise HandrailError(
                f"{where}: LeRobot reads files of no episode, {shortened(stray, ', ')};"
                f" {repair} moves them to .damaged"
            )
    if missing := _missing(info):
        raise HandrailError(
            f"{where} was copied in part: {len(missing)} files are missing"
            f" ({shortened(missing, ', ')}); copy it again"
        )


def check_report(root: str | Path) -> list[str]:
    """Return everything that is wrong with a dataset, a line each; every byte is read."""
    info, found = _surveyed(root, verify=True)
    repair = f"handrail-edit repair {shlex.quote(str(info.root))}"
    if found is None:
        faults = [*(f"{name}: missing" for name in sorted(_missing(info))), *_unreadable(info)]
    else:
        advice = f"if another tool wrote it on purpose, {repair} takes it as it is"
        other = f"written anew, as many frames of like content; {advice}"
        unknown = [f"{found.layout.relative(path)}: no file of a LeRobot dataset" for path in found.unknown]
        faults = [*found.damage, *(f"{name}: {other}" for name in found.rewritten), *unknown]
    layout = Layout(info.root)
    summary = (layout.stats, layout.tasks) if info.episodes else ()
    faults += [f"{path.name}: missing" for path in summary if not path.exists()]
    said = list(_summary_faults(layout, found, f"; {repair} writes it anew"))
    if said and read_info(root).episodes != info.episodes:  # somebody has recorded more meanwhile
        said = []
    return [*faults, *said]


def has_checksums(root: str | Path) -> bool:
    """Return whether there is something to compare a dataset with; another tool writes no checksums."""
    return _surveyed(root, verify=False)[1] is not None


def _surveyed(root: str | Path, verify: bool) -> tuple[DatasetInfo, Survey | None]:
    """Return what a dataset is, and what its checksums say; None where there are none.

    No file of it is a named pipe, a socket or a device, before LeRobot opens any.
    """
    info = read_info(root)
    layout = Layout(info.root)
    for folder in FOLDERS:
        for path in (Path(top, name) for top, _, names in os.walk(info.root / folder) for name in names):
            with explained(f"dataset {str(info.root)!r}: {layout.relative(path)}"):
                if path.exists():  # a link to nowhere is a file that is missing
                    regular(path)
    if not info.from_handrail:
        return info, None
    try:
        return info, survey(layout, read_manifest(layout), Checksums(info.root, anew=verify))
    except ForeignRowError:
        return info, None


def _summary_faults(layout: Layout, found: Survey | None, advice: str) -> Iterator[str]:
    """Yield which summary files cannot be read, or do not say what the episodes say; `advice` ends a line."""
    wanted: dict[Path, bytes | None] = {layout.stats: None}
    if found is not None and found.totals.episodes == found.episodes:
        manifest = read_manifest(layout)
        wanted = summary_files(layout, manifest, found.totals, read_encodings(layout, manifest))
    for path, data in wanted.items():
        if not path.exists():
            continue
        try:
            said = _content(path, read_regular(path, MOST_BYTES))
            right = said if data is None else _content(path, data)
        except UNREADABLE as error:
            yield f"{layout.relative(path)}: {first_line(error)}"
            continue
        keys = right if path == layout.info else {**right, **said}  # other tools may say more of a dataset
        if odd := [key for key in keys if not _alike(said.get(key), right.get(key))]:
            yield f"{layout.relative(path)}: not what the episodes say of {shortened(odd, ', ')}{advice}"


def _content(path: Path, data: bytes) -> dict[str, Any]:
    """Return what a summary file says, by names; of the tasks, their numbers by their sentences."""
    if path.suffix == ".parquet":
        tasks = pq.read_table(pa.BufferReader(data)).to_pydict()
        return dict(zip(tasks["task"], tasks["task_index"], strict=True))
    content = msgspec.convert(parse_json(data), dict[str, Any])
    columns = {"features": features_of(content["features"])} if path.name == "info.json" else {}
    return content | columns  # of a column other tools may say more


def _alike(said: Any, right: Any) -> bool:
    """Return whether a value of a summary file is the right one, but for rounding."""
    if isinstance(right, dict) and isinstance(said, dict):
        return said.keys() == right.keys() and all(_alike(said[key], right[key]) for key in right)
    if isinstance(right, list) and isinstance(said, list):
        return len(said) == len(right) and all(map(_alike, said, right))
    if isinstance(right, float) and isinstance(said, float | int):
        return math.isclose(said, right, rel_tol=_ROUNDING, abs_tol=_ROUNDING)
    return said == right


def _missing(info: DatasetInfo) -> list[str]:
    """Return the data and video files that the episodes name and that are not there."""
    rows, cameras = read_episodes(info.root), video_keys(info.features)
    trouble = f"dataset {str(info.root)!r}: meta/episodes names no files"
    with restated(trouble, (KeyError, ValueError, TypeError)):
        names = [info.data_file(row) for row in rows]
        names += [info.video_file(row, camera) for camera in cameras for row in rows]
    return [name for name in dict.fromkeys(names) if not (info.root / name).is_file()]


def _unreadable(info: DatasetInfo) -> Iterator[str]:
    """Yield which episodes of a dataset without checksums cannot be read, or lack pictures."""
    with open_dataset(info.root) as dataset:
        for episode in range(len(dataset.rows)):
            try:
                dataset.frames(episode)
                with suppress(FileNotFoundError):  # `_missing` names it
                    digest_of_pictures(dataset.info, [dataset.row(episode)])
            except (HandrailError, TypeError) as error:  # a place in a video that is no number
                yield f"episode {episode}: {error}"
