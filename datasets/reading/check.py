"""Checking a dataset before it is used: is everything there that was saved, and is it what was saved?"""

import itertools
import os
from collections.abc import Iterator
from pathlib import Path

from handrail.controllers.errors import HandrailError
from handrail.controllers.regular_file import regular
from handrail.datasets.format.data_file import data_files
from handrail.datasets.format.layout import FOLDERS, Layout
from handrail.datasets.format.lines import ForeignLineError
from handrail.datasets.format.manifest import read_manifest
from handrail.datasets.format.path_pattern import fill
from handrail.datasets.format.schema import video_keys
from handrail.datasets.reading.reader import DatasetInfo, read_episodes, read_info, read_rows_of
from handrail.datasets.recording.checksums import Checksums
from handrail.datasets.recording.repair import require_whole, shortened
from handrail.datasets.recording.survey import Survey, survey
from handrail.datasets.storage.atomic import explained
from handrail.datasets.storage.strict_json import read_json


def check_whole(root: str | Path, verify: bool = False) -> None:
    """Check a dataset that is to be learnt from or compared; cheap where nothing has changed since.

    Args:
        root: Its folder; any LeRobot v3.0 dataset.
        verify: Read every byte anew.
    """
    info = read_info(root)
    _check_kinds(info.root)
    found = _surveyed(info, verify)
    if found is not None:
        require_whole(Layout(info.root), found)
    missing = [info.root / name for name in dict.fromkeys(_files(info)) if not (info.root / name).is_file()]
    if missing:
        names = shortened([path.relative_to(info.root).as_posix() for path in missing], ", ")
        raise HandrailError(
            f"dataset {str(info.root)!r} was copied in part: {len(missing)} files are missing ({names});"
            " copy it again"
        )


def _check_kinds(root: Path) -> None:
    """Check that no file of a dataset is a named pipe, a socket or a device, before LeRobot opens any."""
    for top, _, names in itertools.chain.from_iterable(os.walk(root / name) for name in FOLDERS):
        for path in (Path(top, name) for name in names):
            with explained(f"dataset {str(root)!r}: {path.relative_to(root)}"):
                if path.exists():  # a link to nowhere is a file that is missing
                    regular(path)


def check_report(root: str | Path) -> list[str]:
    """Return everything that is wrong with a dataset, a line each; every byte is read."""
    info = read_info(root)
    _check_kinds(info.root)
    found = _surveyed(info, verify=True)
    if found is None:
        return [*_unread(info), *_statistics(info)]
    differing = dict.fromkeys(name for state in found.rewritten for name in state.rewritten)
    advice = f"if another tool wrote it on purpose, handrail-edit repair {info.root} takes it as it is"
    return [
        *found.faults(),
        *(f"{name}: other content than was saved, but the right frames; {advice}" for name in differing),
        *(f"{path.relative_to(info.root)}: no file of a LeRobot dataset" for path in found.strays),
        *_statistics(info),
    ]


def _surveyed(info: DatasetInfo, verify: bool) -> Survey | None:
    """Return what the checksums say; None where there are none."""
    if not info.from_handrail:
        return None
    sums = Checksums(info.root, anew=verify)
    try:
        found = survey(Layout(info.root), read_manifest(Layout(info.root)), sums.of)
    except ForeignLineError:
        return None
    sums.remember()
    return found


def _files(info: DatasetInfo) -> Iterator[str]:
    """Yield the paths of all data and video files that the episodes name."""
    rows = read_episodes(info.root)
    try:
        for row in rows:
            yield fill(info.data_path, row["data/chunk_index"], row["data/file_index"])
        for key in video_keys(info.features):
            for row in rows:
                place = [row[f"videos/{key}/{name}"] for name in ("chunk_index", "file_index")]
                yield fill(info.video_path, *place, video_key=key)
    except (KeyError, ValueError, TypeError) as error:
        raise HandrailError(f"dataset {str(info.root)!r}: meta/episodes names no files: {error}") from error


def _unread(info: DatasetInfo) -> list[str]:
    """Return which episodes of a dataset without checksums cannot be read."""
    said = [f"{name}: missing" for name in sorted(set(_files(info))) if not (info.root / name).is_file()]
    with data_files() as files:
        for row in read_episodes(info.root):
            try:
                read_rows_of(info, row, files=files)
            except HandrailError as error:
                said.append(f"episode {row['episode_index']}: {error}")
    return said


def _statistics(info: DatasetInfo) -> list[str]:
    """Return why other tools cannot read the statistics, if they cannot."""
    path = Layout(info.root).stats
    try:
        read_json(path)
    except FileNotFoundError:
        return [f"{path.name}: missing"] if info.episodes else []
    except (OSError, ValueError) as error:
        return [f"meta/{path.name}: {error}"]
    return []
