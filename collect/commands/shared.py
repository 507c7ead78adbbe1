"""Records with several workers: each its own shards, episode by episode crash-safe; merged in the end.

A shard is a dataset of a few episodes. All lie beside the dataset, in `.NAME.shards`, until they are whole
and become one. Which episodes a shard has does not depend on who records it: whatever is cut short goes on
with any number of workers.
"""

import json
import os
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import chain
from pathlib import Path
from typing import Any, Literal

import pyarrow as pa

from handrail.collect.commands.account import RecordingLog
from handrail.collect.commands.recording import Recording, open_writer
from handrail.collect.config import RecordConfig
from handrail.collect.execution.execution import Execution
from handrail.collect.execution.job import Job, part_jobs
from handrail.collect.session.build import build_env
from handrail.collect.session.outcome import Outcome
from handrail.collect.session.recorded import settings_json
from handrail.collect.world.env import HandrailEnv
from handrail.controllers.errors import HandrailError, restated
from handrail.controllers.typed import Count, decoded
from handrail.datasets.editing.merge import copy_episodes
from handrail.datasets.editing.source import EditSource
from handrail.datasets.format.episode_rows import EpisodeRows, row_files
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.recording.rewrite import settle
from handrail.datasets.recording.slice import EpisodeSlice
from handrail.datasets.recording.writer import EpisodeWriter
from handrail.datasets.storage.atomic import beside, explained, remove
from handrail.datasets.storage.lock import FolderLock, HeldError
from handrail.datasets.storage.strict_json import load_json, write_json

_PLAN = "plan.json"
_FORMAT = "handrail.shards/1"
_DYING = 60.0  # of a worker whose parent or computer is lost [s]
_MOMENT = 0.1  # [s]


@dataclass(frozen=True)
class _Plan:
    """The recording's settings, as they lie beside the shards."""

    format: Literal["handrail.shards/1"]
    first: Count  # how many episodes the dataset had before
    settings: dict[str, Any]


class Shards:
    """The shards of a recording, begun or not.

    Args:
        config: of the recording.
    """

    def __init__(self, config: RecordConfig) -> None:
        self._config = config
        self.root = Path(os.path.realpath(config.dataset.folder))
        self.folder = beside(self.root, "shards")
        self._file = self.folder / _PLAN

    @property
    def begun(self) -> bool:
        """Whether there are any, of this recording or another."""
        return self._file.is_file()

    def going_on(self) -> RecordConfig:
        """Return the settings that go on with the shards that are there, which must be of this recording."""
        if (staging := Layout(self.root).staging).exists():  # a recording that still runs
            FolderLock(staging, existing=True).release()
        with explained(f"cannot go on with dataset {str(self.root)!r}"):
            settle(self.root)  # a merge that was cut short
        for name, now in self._settings.items():
            before = self._plan.settings.get(name)
            if before != now:
                raise HandrailError(
                    f"{str(self.folder)!r} holds episodes of a recording that was cut short, with {name}"
                    f" {before!r}, got {now!r}: the same flags as then finish it;"
                    " remove the folder to give them up"
                )
        return replace(self._config, resume=Layout(self.root).manifest.is_file(), overwrite=False)

    def begin(self, first: int) -> None:
        """Take note of what is to be recorded, beside a dataset that has so many episodes already."""
        with explained(f"cannot record beside dataset {str(self.root)!r}"):
            remove(self.folder)  # without a plan it is of another recording, and was being removed
            write_json(self._file, {"format": _FORMAT, "first": first, "settings": self._settings})

    def jobs(self, episodes: int) -> list[Job]:
        """Return what records the shards, for a dataset with so many episodes; none if it has them all."""
        first, end = self._plan.first, self._plan.first + self._config.dataset.num_episodes
        if episodes not in (first, end):
            raise HandrailError(
                f"dataset {str(self.root)!r}: expected {first} episodes, as when {str(self.folder)!r}"
                f" was begun, found {episodes}; remove the one or the other"
            )
        return part_jobs(record_shard, self._config, self.folder / "shard", episodes, end)

    def record(self, jobs: Sequence[Job], log: RecordingLog, execution: Execution) -> None:
        """Record the shards, and make one dataset of what was there before and of them, in order.

        Nothing is encoded anew. The caller has the sole right to write there.
        """
        for result in execution.run(jobs):
            if result.error:
                raise HandrailError(
                    f"{result.job.name}: {result.error}; the recording is kept in {self.folder}, and the"
                    " same flags go on"
                )
            for outcome in result.value:
                log.add(outcome)
            execution.say(log.words)
        execution.say(f"{log.words}, merging")
        with explained(f"cannot write dataset {str(self.root)!r}"):
            self._merge(jobs)

    def remove(self) -> None:
        """Remove them; the plan first, so that nobody goes on with a part."""
        with explained(f"cannot remove {str(self.folder)!r}"):
            remove(self._file)
            remove(self.folder)

    @cached_property
    def _plan(self) -> _Plan:
        return decoded(load_json(self._file, "the plan of a recording"), _Plan, str(self._file))

    @property
    def _settings(self) -> dict[str, Any]:
        dataset = self._config.dataset
        names = ("name", "fps", "single_task", "num_episodes")
        return json.loads(settings_json(self._config)) | {name: getattr(dataset, name) for name in names}

    def _merge(self, jobs: Sequence[Job]) -> None:
        roots = [self.root] * bool(self._plan.first) + [jobs[0].arguments[1]]
        sources = [EditSource.open(root) for root in roots]
        before = sources[0].slices() if self._plan.first else ()
        new = chain.from_iterable(_slices(job, sources[0].manifest) for job in jobs)
        with restated(f"{str(self.folder)!r} cannot be read", (pa.ArrowException, ValueError, KeyError)):
            copy_episodes(sources, self.root, chain(before, new), in_place=True)


def _slices(job: Job, manifest: Manifest) -> Iterator[EpisodeSlice]:
    """Yield the episodes of a shard."""
    layout = Layout(job.arguments[1])
    rows = map(EpisodeRows.read, row_files(layout))
    records = list(chain.from_iterable(each.records(with_stats=True) for each in rows))
    if len(records) != job.size:
        raise HandrailError(f"dataset {str(layout.root)!r}: expected {job.size} episodes, got {len(records)}")
    yield from (EpisodeSlice.of(layout, manifest, record) for record in records)


def record_shard(config: RecordConfig, folder: Path, first: int, episodes: int) -> list[Outcome]:
    """Record a part of a recording into a dataset of its own; return how those went that were not there yet.

    Args:
        config: of the whole recording.
        folder: of the part.
        first: number of its first episode in the whole.
        episodes: how many it has.
    """
    if not (folder.parent / _PLAN).is_file():
        words = "expected the folder of the command, which all computers have to share; found none"
        raise HandrailError(f"{str(folder.parent)!r}: {words}")
    env, recording = _recording(config)
    own = replace(config, dataset=replace(config.dataset, place=str(folder), root=""))
    with _opened(own, folder, env) as writer:
        return list(recording.episodes(writer, episodes, first=first))


def _opened(config: RecordConfig, folder: Path, env: HandrailEnv) -> EpisodeWriter:
    """Return the writer of a part; whoever had it, and was given up for dead, gets a moment to die."""
    given_up = time.monotonic() + _DYING
    while True:
        there = Layout(folder).manifest.is_file()
        try:
            return open_writer(replace(config, resume=there, overwrite=False, verify=False), env)
        except HeldError:
            if time.monotonic() > given_up:
                raise
            time.sleep(_MOMENT)


@lru_cache(maxsize=1)
def _recording(config: RecordConfig) -> tuple[HandrailEnv, Recording]:
    """Return what records, built once a process, for it takes as long as a part of an episode."""
    env = build_env(config, config.dataset.fps)
    return env, Recording(config, env)
