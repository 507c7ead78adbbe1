"""Records episodes into a dataset, with a progress bar, and says what came of it."""

import time
from collections.abc import Callable
from contextlib import ExitStack, closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from handrail.collect.commands.account import RecordingLog
from handrail.collect.commands.recording import Recording, come_first, located, open_writer, session_writer
from handrail.collect.commands.shared import Shards
from handrail.collect.config import RecordConfig
from handrail.collect.execution.execution import Execution, WorkBar
from handrail.collect.execution.pool import RECORDING
from handrail.collect.operators.catalogue import OPERATORS
from handrail.collect.operators.operator import Operator
from handrail.collect.session.build import build_env, build_mode
from handrail.collect.session.display import Display
from handrail.collect.world.env import HandrailEnv
from handrail.controllers.errors import FAILED
from handrail.controllers.registry import resolved
from handrail.datasets.format.layout import Layout
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.reading.reader import read_info
from handrail.datasets.recording.folder import check_target
from handrail.datasets.recording.writer import EpisodeWriter

if TYPE_CHECKING:
    from handrail.collect.lekiwi.link import Link

Share = Callable[[RecordConfig, Operator, HandrailEnv], Operator]


def record(config: RecordConfig, share: Share | None = None) -> int:
    """Record as configured; return the exit code: 0, 1 after a failure, 130 after Ctrl-C.

    Args:
        config: of the recording.
        share: lets policies of the settings drive beside a person.
    """
    console, log, shards = Terminal(stderr=True), RecordingLog(), Shards(config)
    if config.is_shared or shards.begun:
        saved = _record_shared(config, shards, log, console)
    else:
        saved = _record_here(config, share, log, console)
    log.report(config, *saved, console)
    return log.exit_code


def _record_here(
    config: RecordConfig, share: Share | None, log: RecordingLog, console: Terminal
) -> tuple[Path, int, int]:
    """Record in this process; return the dataset's folder and its episodes and frames."""
    operator = OPERATORS.find(config.operator)
    interactive = operator.interactive
    if interactive or config.robot_client:
        come_first()
    with ExitStack() as stack:
        env, link = _opened(config, interactive, stack)
        shown = config.display_data, config.display_web, config.display_save
        displays = [stack.enter_context(closing(Display(*shown, console.print)))] if any(shown) else []
        build_mode(config, env.model)  # a wrong mask, or cameras without GL, show before anything is written
        if not env.real:  # a robot moves when there is somebody to stop it
            env.reset(seed=config.seed)
        config = located(config, env)
        if interactive and not config.resume:  # before a person's page is opened, or their device
            check_target(Layout(config.dataset.folder.absolute()), config.overwrite)
        person: Any = None
        if interactive:  # whoever steers now at this computer
            person = stack.enter_context(closing(resolved(operator.build)(config, env, console.print)))
            if link:
                link.asked = person.between
        beside = (lambda person: share(config, person, env)) if share else None
        recording = Recording(config, env, person, displays, beside)
        writer = stack.enter_context(session_writer(config, env))
        _print_state(writer, console)
        recording.into(writer)
        if interactive or env.real:
            console.print("Getting ready; this takes some seconds.")
            recording.warm_up(config.seed)
            console.print("Ready.")
        count = config.dataset.num_episodes
        with (
            log.noting("the open episode is dropped, the saved ones are whole"),
            WorkBar(console, "recording", count, [person]) as bar,
        ):
            for _ in recording.episodes(writer, writer.num_episodes + count, log.add):
                bar.show(completed=len(log.outcomes), words=log.words)
        if interactive and log.exit_code == FAILED:
            person.trouble = log.trouble  # a page says it
        return writer.root, writer.num_episodes, writer.num_frames


def _record_shared(
    config: RecordConfig, shards: Shards, log: RecordingLog, console: Terminal
) -> tuple[Path, int, int]:
    """Record with several workers, or go on with what they left; return what `_record_here` does."""
    start, goes_on = time.monotonic(), shards.begun
    if goes_on:
        config = shards.going_on()
    with (
        Execution(config, "recording", console, RECORDING) as execution,
        closing(build_env(config, config.dataset.fps)) as env,
    ):
        Recording(config, env)  # a wrong mask, or cameras without GL, show before anything is written
        env.reset(seed=config.seed)
        with open_writer(config, env) as writer:  # nobody else writes there meanwhile
            _print_state(writer, console)
            if not goes_on:
                shards.begin(writer.num_episodes)
            jobs = shards.jobs(writer.num_episodes)
            with log.noting(f"the recording is kept in {shards.folder}, and the same flags go on"):
                if jobs:
                    shards.record(jobs, log, execution)
    if not log.exit_code:
        with log.noting():
            shards.remove()
    log.wall_time, log.kept = time.monotonic() - start, shards.begun
    info = read_info(shards.root)
    return shards.root, info.episodes, info.frames


def _print_state(writer: EpisodeWriter, console: Terminal) -> None:
    if writer.repaired and not writer.repaired.clean:
        console.print(str(writer.repaired))
    if writer.num_episodes:
        console.print(f"Adds to {writer.root}; episodes there: {writer.num_episodes}")


def _opened(config: RecordConfig, interactive: bool, stack: ExitStack) -> tuple[HandrailEnv, "Link | None"]:
    """Return the environment, and the link to the robot if it is no simulation."""
    if not config.robot_client:
        return stack.enter_context(closing(build_env(config, config.dataset.fps, render=interactive))), None
    from handrail.collect.lekiwi.client_plant import open_client  # loads LeRobot

    env, link = open_client(config)
    stack.callback(link.close)
    return stack.enter_context(closing(env)), link
