"""Records with several workers: each its own shards, episode by episode crash-safe; one merge at the end."""

import time
from contextlib import closing
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from rich.console import Console

from handrail.collect.commands.account import PLAIN, RecordingLog, report
from handrail.collect.commands.recording import Recording, episode_seed, open_writer
from handrail.collect.commands.shards import Shards
from handrail.collect.config import RecordConfig
from handrail.collect.envs.env import HandrailEnv
from handrail.collect.execution.execution import Execution
from handrail.collect.execution.interrupts import Interrupts
from handrail.collect.execution.job import Job
from handrail.collect.session.build import build_env, build_session
from handrail.collect.session.outcome import Outcome
from handrail.controllers.errors import HandrailError
from handrail.datasets.format.layout import Layout
from handrail.datasets.reading.reader import read_info
from handrail.datasets.recording.writer import EpisodeWriter
from handrail.datasets.storage.lock import HeldError

INTERRUPTED = 130
FAILED = 1
_DYING = 60.0  # of a worker whose parent or computer is lost [s]
_MOMENT = 0.1  # [s]
_PRELOAD = ("handrail.collect.commands.shared",)


def record_shared(config: RecordConfig, console: Console) -> int:
    """Record as configured, the work shared; return the exit code: 0, 1 after a failure, 130 after Ctrl-C.

    What was recorded before a failure is kept: the same flags go on, with any number of workers.

    Args:
        config: of the recording.
        console: to say how far it is, and what came of it.

    Raises:
        HandrailError: a setting is wrong; nothing has been written then.
    """
    shards, log, start = Shards(config), RecordingLog(), time.monotonic()
    going_on = shards.begun
    if going_on:
        shards.check()
        config = replace(config, resume=Layout(shards.root).manifest.is_file(), overwrite=False)
    with (
        Execution(config, "recording", console, _PRELOAD) as execution,
        closing(build_env(config, config.dataset.fps)) as env,
    ):
        build_session(config, env)  # a wrong mask, or cameras without GL, show before anything is written
        env.reset(seed=config.seed)
        with open_writer(config, env) as writer:  # nobody else writes there meanwhile
            if writer.repaired and not writer.repaired.clean:
                console.print(str(writer.repaired), **PLAIN)
            if not going_on:
                shards.begin(writer.num_episodes)
            merged = shards.are_in(writer.num_episodes)
            if not merged:
                _record_all(config, shards, log, execution)
    _finish(shards, merged, log)
    log.wall_time = time.monotonic() - start
    info = read_info(shards.root)
    report(config, shards.root, info.episodes, info.frames, log, console)
    return log.exit_code


def _record_all(config: RecordConfig, shards: Shards, log: RecordingLog, execution: Execution) -> None:
    """Record all shards, until that is done, one fails, or an interrupt comes."""
    jobs = [
        Job(
            each.name,
            record_shard,
            (config, each.folder, each.first, each.episodes),
            (),
            each.episodes,
            each.log,
        )
        for each in shards.all
    ]
    goes_on = "what was recorded is kept, and the same flags go on"
    try:
        for result in execution.run(jobs):
            if result.error:
                raise HandrailError(f"{result.job.name}: {result.error}; {goes_on}")
            for outcome in result.value:
                log.add(outcome)
            execution.say(log.words)
    except KeyboardInterrupt:
        log.trouble, log.exit_code = f"interrupted; {goes_on}", INTERRUPTED
    except HandrailError as error:
        log.trouble, log.exit_code = str(error), FAILED


def _finish(shards: Shards, merged: bool, log: RecordingLog) -> None:
    """Make one dataset of the shards, if all are whole, and remove them."""
    if log.exit_code:
        return
    try:
        if not merged:
            shards.merge()
        shards.remove()
    except HandrailError as error:
        log.trouble, log.exit_code = str(error), FAILED


def record_shard(config: RecordConfig, folder: Path, first: int, episodes: int) -> list[Outcome]:
    """Record a part of a recording into a dataset of its own; return how those went that were not there yet.

    Every episode is what it would be in one whole recording: it depends on its seed alone.

    Args:
        config: of the whole recording.
        folder: of the part.
        first: number of its first episode in the whole.
        episodes: how many it has.

    Raises:
        HandrailError: the disk or an encoder failed; the saved episodes are whole.
    """
    own = replace(config, dataset=replace(config.dataset, place=str(folder), root=""))
    env, outcomes = _env(config), list[Outcome]()
    with _opened(own, folder, env) as writer, Interrupts() as interrupts:
        recording = Recording(own, env, writer)
        while writer.num_episodes < episodes:
            seed = episode_seed(config.seed, first + writer.num_episodes)
            outcomes.append(recording.episode(seed, interrupts))
    return outcomes


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
def _env(config: RecordConfig) -> HandrailEnv:
    """Return the environment of a recording, built once a process."""
    return build_env(config, config.dataset.fps)
