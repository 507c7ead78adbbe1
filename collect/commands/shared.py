"""Records with several workers: each its own shards, episode by episode crash-safe; merged as they come."""

import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import closing, contextmanager
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from threading import Event

from handrail.collect.commands.account import RecordingLog, report
from handrail.collect.commands.recording import Recording, episode_seed, open_writer
from handrail.collect.commands.shards import Shard, Shards
from handrail.collect.config import RecordConfig
from handrail.collect.execution.execution import Execution
from handrail.collect.execution.forking import RECORDING
from handrail.collect.execution.job import Job
from handrail.collect.session.build import build_env, build_session
from handrail.collect.session.outcome import Outcome
from handrail.collect.world.env import HandrailEnv
from handrail.controllers.errors import FAILED, INTERRUPTED, HandrailError
from handrail.controllers.interrupts import Interrupts
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.lines import each_line
from handrail.datasets.format.metadata import EpisodeRecord
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.reading.reader import read_info
from handrail.datasets.recording.writer import EpisodeWriter
from handrail.datasets.storage.lock import HeldError

_DYING = 60.0  # of a worker whose parent or computer is lost [s]
_MOMENT = 0.1  # [s]
_RECORDINGS: dict[RecordConfig, Recording] = {}


def record_shared(config: RecordConfig, console: Terminal) -> int:
    """Record as configured, the work shared; return the exit code: 0, 1 after a failure, 130 after Ctrl-C.

    What was recorded before a failure is kept: the same flags go on, with any number of workers.

    Args:
        config: of the recording.
        console: to say how far it is, and what came of it.
    """
    shards, log, start = Shards(config), RecordingLog(), time.monotonic()
    going_on = shards.begun
    if going_on:
        shards.check()
        config = replace(config, resume=Layout(shards.root).manifest.is_file(), overwrite=False)
    with (
        Execution(config, "recording", console, RECORDING) as execution,
        closing(build_env(config, config.dataset.fps)) as env,
    ):
        build_session(config, env)  # a wrong mask, or cameras without GL, show before anything is written
        env.reset(seed=config.seed)
        with open_writer(config, env) as writer:  # nobody else writes there meanwhile
            if writer.repaired and not writer.repaired.clean:
                console.print(str(writer.repaired))
            if not going_on:
                shards.begin(writer.num_episodes)
            merged = shards.are_in(writer.num_episodes)
            if not merged:
                _record_all(config, shards, log, execution)
    if not log.exit_code:
        _remove(shards, log)
    log.wall_time = time.monotonic() - start
    info = read_info(shards.root)
    report(config, shards.root, info.episodes, info.frames, log, console)
    return log.exit_code


def _record_all(config: RecordConfig, shards: Shards, log: RecordingLog, execution: Execution) -> None:
    """Record all shards and merge them, until that is done, one fails, or an interrupt comes."""
    parts = {each.name: each for each in shards.all}
    jobs = [
        Job(name, record_shard, (config, each.folder, each.first, each.episodes), (), each.episodes, each.log)
        for name, each in parts.items()
    ]
    goes_on = f"what was recorded is kept in {shards.folder}, and the same flags go on"
    try:
        with _merging(shards) as take:
            for result in execution.run(jobs, part=lambda job: parts[job.name].saved):
                if result.error:
                    raise HandrailError(f"{result.job.name}: {result.error}; {goes_on}")
                outcomes, lines = result.value
                for outcome in outcomes:
                    log.add(outcome)
                execution.say(log.words)
                take(result.job.name, lines)
            execution.say(f"{log.words}, merging")
    except KeyboardInterrupt:
        log.trouble, log.exit_code = f"interrupted; {goes_on}", INTERRUPTED
    except HandrailError as error:
        log.trouble, log.exit_code = str(error), FAILED


@contextmanager
def _merging(shards: Shards) -> Iterator[Callable[[str, Sequence[EpisodeRecord]], None]]:
    """Merge shards while others are recorded; yield a function that takes a whole one by name and lines."""
    whole = {each.name: Future[Sequence[EpisodeRecord]]() for each in shards.all}
    stopped = Event()

    def lines(shard: Shard) -> Sequence[EpisodeRecord]:
        found = whole[shard.name].result()
        del whole[shard.name]  # some 50 kB an episode
        if stopped.is_set():
            raise CancelledError
        return found

    def take(name: str, found: Sequence[EpisodeRecord]) -> None:
        whole[name].set_result(found)
        if merge.done():  # not all are whole: it failed
            merge.result()

    with ThreadPoolExecutor(1) as thread:
        merge = thread.submit(shards.merge, lines)
        try:
            yield take
            merge.result()
        except BaseException:
            stopped.set()
            for each in list(whole.values()):
                each.cancel()
            raise


def _remove(shards: Shards, log: RecordingLog) -> None:
    try:
        shards.remove()
    except HandrailError as error:
        log.trouble, log.exit_code = str(error), FAILED


def record_shard(
    config: RecordConfig, folder: Path, first: int, episodes: int
) -> tuple[list[Outcome], list[EpisodeRecord]]:
    """Record a part of a recording into a dataset of its own.

    Every episode is what it would be in one whole recording: it depends on its seed alone.

    Args:
        config: of the whole recording.
        folder: of the part.
        first: number of its first episode in the whole.
        episodes: how many it has.

    Returns:
        How those went that were not there yet, and the lines of metadata of all.
    """
    own = replace(config, dataset=replace(config.dataset, place=str(folder), root=""))
    env, outcomes = _env(config), list[Outcome]()
    with _opened(own, folder, env) as writer, Interrupts() as interrupts:
        lines = list(each_line(Layout(folder), with_stats=True))
        recording = _recording(config, env, writer)
        while writer.num_episodes < episodes:
            seed = episode_seed(config.seed, first + writer.num_episodes)
            outcomes.append(recording.episode(seed, interrupts))
            lines += [writer.last] if writer.last else []
    return outcomes, lines


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


def _recording(config: RecordConfig, env: HandrailEnv, writer: EpisodeWriter) -> Recording:
    """Return what records, built once a process, for it takes as long as a part of an episode."""
    if config not in _RECORDINGS:
        _RECORDINGS.clear()
        _RECORDINGS[config] = Recording(config, env, writer)
    _RECORDINGS[config].into(writer)
    return _RECORDINGS[config]


@lru_cache(maxsize=1)
def _env(config: RecordConfig) -> HandrailEnv:
    """Return the environment of a recording, built once a process."""
    return build_env(config, config.dataset.fps)
