"""Editing datasets that Handrail recorded: every column and every episode's metadata stays.

A new dataset is written from episodes of old ones, in one pass; it has its name only when it is whole.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import accumulate

import numpy as np
import pyarrow as pa

from handrail.controllers.errors import HandrailError, check_known
from handrail.datasets.editing import config as verbs
from handrail.datasets.editing.merge import Edited, copy_episodes
from handrail.datasets.editing.source import EditSource, opened
from handrail.datasets.format.data_file import data_files
from handrail.datasets.format.metadata import ColumnTypes
from handrail.datasets.format.video import GROUP
from handrail.datasets.quality.motion import FLOOR
from handrail.datasets.reading import naming
from handrail.datasets.reading.demonstration import Demonstration
from handrail.datasets.reading.reader import read_rows_of
from handrail.datasets.recording.rewrite import drafted
from handrail.datasets.recording.slice import TRIMMED, EpisodeSlice

_LABELS = {"success": pa.bool_(), "failure_reason": pa.string()}
_SHARE = 0.01  # of an entry's range in the episode
_STATE, _SUCCESS = "observation.state", "next.success"
_RANGE = re.compile(r"(\d{1,9})(?:-(\d{1,9}))?")
_ENDINGS = {"failed": False, "succeeded": True}
_ROUNDING = 1e-9


def edit(config: verbs.EditConfig) -> list[Edited]:
    """Do what a config says and return the datasets that were written."""
    config.check()
    with opened([config.root], config.target, config.verify) as (source,):
        if not isinstance(config, verbs.SplitConfig):
            types = _types(config, source.types)
            slices = _slices(config, source)
            return [copy_episodes([source], config.target, slices, config.name, config.in_place, types)]
        edited, name = list[Edited](), config.name or source.manifest.repo_id
        with drafted(config.target) as draft:  # the parts are there all together or none of them
            for part, numbers in _parts(config.parts, source.successes).items():
                slices = source.slices(numbers)
                edited.append(copy_episodes([source], draft.root / part, slices, f"{name}_{part}"))
        return [replace(each, root=config.target / each.root.name) for each in edited]


def _types(config: verbs.EditConfig, types: ColumnTypes) -> ColumnTypes:
    """Return the extra columns after an edit."""
    if isinstance(config, verbs.RelabelConfig):
        return {**_LABELS, **types}
    return {**types, TRIMMED: pa.int64()} if isinstance(config, verbs.TrimConfig) else types


def _slices(config: verbs.EditConfig, source: EditSource) -> Iterator[EpisodeSlice]:
    """Return what a dataset's episodes become."""
    words, everything = getattr(config, "episodes", ()), range(len(source.rows))
    chosen = set(_chosen("--episodes", words, source.successes))
    if isinstance(config, verbs.DeleteConfig | verbs.KeepConfig):
        return source.slices(chosen if isinstance(config, verbs.KeepConfig) else set(everything) - chosen)
    if isinstance(config, verbs.RenameConfig) and config.old_task:
        tasks = {task for row in source.rows for task in row["tasks"]}
        check_known("task", (config.old_task,), tasks)
    touched = chosen if words else set(everything)
    return (
        _changed(config, source, each) if each.record.episode in touched else each for each in source.slices()
    )


def _changed(config: verbs.EditConfig, source: EditSource, whole: EpisodeSlice) -> EpisodeSlice:
    if isinstance(config, verbs.RelabelConfig):
        success = config.label == "success"
        reason = "" if success else config.reason or "relabelled"
        return replace(whole.saying(success=success, failure_reason=reason), success=success)
    if isinstance(config, verbs.RenameConfig):
        old = {task for task in whole.record.tasks if not config.old_task or task == config.old_task}
        return replace(whole, sentences=dict.fromkeys(old, config.task))
    assert isinstance(config, verbs.TrimConfig)
    number = whole.record.episode
    row, columns = source.rows[number], [each for each in (_STATE, _SUCCESS) if each in source.info.features]
    with data_files() as files:
        frames = read_rows_of(source.info, row, columns, files)
    first, length = moving_stretch(Demonstration(number, source.info, frames, row), config.margin)
    before = whole.columns.get(TRIMMED) or 0
    return replace(whole, first=first, length=length).saying(**{TRIMMED: int(before) + first})


def moving_stretch(episode: Demonstration, margin: float) -> tuple[int, int]:
    """Return the first frame and the number of frames between what is idle at both ends.

    A frame is idle while |q(t) − q(end)| ≤ max(0.005, 1 % of the range) for every entry of the
    configuration q and every gripper, where the end is that of its side. The first frame with success is
    never cut off. Where there are cameras, the first frame begins a group of pictures, so that videos need
    not be encoded anew.

    Args:
        episode: Which; its configuration in the units of its state.
        margin: Time to leave on both sides [s].
    """
    grippers = naming.gripper_entries(episode.entries("state"))
    positions, count = np.hstack([episode.configuration, episode.matrix("state")[:, grippers]]), episode.count
    still = np.maximum(FLOOR, _SHARE * np.ptp(positions, axis=0))
    moved, away = (np.flatnonzero((abs(positions - positions[end]) > still).any(axis=1)) for end in (0, -1))
    if not moved.size or not away.size:
        return 0, count
    spare = round(margin * episode.fps)
    done = np.flatnonzero(episode.frames.get(_SUCCESS, ()))[:1]
    first = max(0, min([int(moved[0]) - spare, *done.tolist()]))
    end = max(min(count, int(away[-1]) + 2 + spare), *(int(frame) + 1 for frame in done), 0)
    if end <= first:
        return 0, count
    pictured = any(feature.is_video for feature in episode.info.features.values())
    first -= first % GROUP if pictured else 0
    return first, end - first


def _chosen(flag: str, words: Sequence[str], successes: Sequence[bool | None]) -> list[int]:
    """Return the episodes that are meant, in order, each once.

    Args:
        flag: That the words are of, for the error.
        words: Numbers, ranges, `failed` or `succeeded`.
        successes: Of every episode of the dataset; None where that is not known.
    """
    found: set[int] = set()
    for word in words:
        if word in _ENDINGS:
            found |= {number for number, success in enumerate(successes) if success is _ENDINGS[word]}
        elif match := _RANGE.fullmatch(word):
            first, last = int(match[1]), int(match[2] or match[1])
            if not first <= last < len(successes):
                raise HandrailError(f"{flag} {word}: expected episodes from 0 to {len(successes) - 1}")
            found |= set(range(first, last + 1))
        else:
            raise HandrailError(f"{flag} {word}: expected a number, a range such as 0-4, failed or succeeded")
    return sorted(found)


def _parts(words: Sequence[str], successes: Sequence[bool | None]) -> Mapping[str, list[int]]:
    """Return the episodes of each part.

    Args:
        words: `NAME=SHARE` each, or `NAME=EPISODE` with more episodes after it.
        successes: As for `_chosen`.
    """
    given: dict[str, list[str]] = {}
    for word in words:
        name, equals, said = word.rpartition("=")
        if equals and (not re.fullmatch(r"\w[\w.-]*", name) or name in given):
            raise HandrailError(f"--parts {word}: expected a name of its own, as in {name or 'train'}=0.8")
        if not equals and not given:
            raise HandrailError(f"--parts {word}: expected NAME=SHARE or NAME=EPISODES")
        given.setdefault(name if equals else list(given)[-1], []).append(said)
    count = len(successes)
    lone = [said[0] for said in given.values() if len(said) == 1]
    shares = [float(said) for said in lone if re.fullmatch(r"[01]?\.\d{1,9}|1\.", said)]
    if shares and len(shares) < len(given):
        raise HandrailError("--parts: expected shares or episodes for all of them, got both")
    if sum(shares) > 1.0 + _ROUNDING:
        raise HandrailError(f"--parts: expected shares up to 1 together, got {sum(shares):g}")
    if shares:
        ends = [round(total * count) for total in accumulate(shares, initial=0.0)]
        parts = {name: list(range(*ends[place : place + 2])) for place, name in enumerate(given)}
    else:
        parts = {name: _chosen(f"--parts {name}", said, successes) for name, said in given.items()}
    if empty := [name for name, numbers in parts.items() if not numbers]:
        raise HandrailError(f"--parts {empty[0]}: expected an episode or more of {count}, got none")
    everything = [number for numbers in parts.values() for number in numbers]
    if twice := [number for number in everything if everything.count(number) > 1]:
        raise HandrailError(f"--parts: expected each episode in one part, got episode {twice[0]} in two")
    return parts
