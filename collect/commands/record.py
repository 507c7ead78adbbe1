"""Records episodes into a dataset, with a progress bar, and says what came of it."""

from collections.abc import Iterable, Sequence
from typing import Any

from rich.console import RenderableType
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.protocol import is_renderable

from handrail.collect.commands.account import RecordingLog, report
from handrail.collect.commands.recording import Recording, come_first, episode_seed, session_writer
from handrail.collect.commands.shards import Shards
from handrail.collect.commands.shared import record_shared
from handrail.collect.commands.target import located
from handrail.collect.config import RecordConfig
from handrail.collect.operators.catalogue import OPERATORS
from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.session.build import build_env, build_modes, build_session
from handrail.collect.session.display import Display
from handrail.collect.world.env import HandrailEnv
from handrail.controllers.errors import FAILED, INTERRUPTED, HandrailError
from handrail.controllers.interrupts import Interrupts
from handrail.controllers.registry import resolved
from handrail.datasets.format.layout import Layout
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.recording.folder import check_target
from handrail.datasets.recording.writer import EpisodeWriter


class _Progress(Progress):
    """The bar of a recording, below what the people who steer have to show."""

    def __init__(self, *columns: ProgressColumn, console: Terminal, shown: Sequence[Any]) -> None:
        self._shown = shown  # the bar draws itself once while it is made
        super().__init__(*columns, console=console)

    def get_renderables(self) -> Iterable[RenderableType]:
        """Return what is shown."""
        yield from self._shown
        yield from super().get_renderables()


def recording_bar(console: Terminal, people: Sequence[Any]) -> Progress:
    """Return the bar of a recording, not started.

    Args:
        console: to draw on.
        people: who steer now; what rich can draw of them is shown above the bar.
    """
    return _Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[success]}"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=console,
        shown=[each for each in people if is_renderable(each)],
    )


def record(config: RecordConfig) -> int:
    """Record as configured; return the exit code: 0, 1 after a failure, 130 after Ctrl-C.

    Args:
        config: of the recording.
    """
    console = Terminal(stderr=True)
    if config.is_shared or Shards(config).begun:
        return record_shared(config, console)
    interactive = OPERATORS.find(config.operator).interactive
    if interactive or config.robot_client:
        come_first()
    env, link = _opened(config, interactive)
    displays: list[Display] = []
    people: list[Any] = []
    try:
        displays = _displays(config, console)
        try_out = build_modes if interactive else build_session
        try_out(config, env)  # a wrong mask, or cameras without GL, show before anything is written
        env.reset(seed=config.seed)
        config = located(config, env)
        if interactive and not config.resume:  # before a person's page is opened, or their device
            check_target(Layout(config.dataset.folder.absolute()), config.overwrite)
        people = _people(config, env, console)
        with session_writer(config, env) as writer:
            if writer.repaired and not writer.repaired.clean:
                console.print(str(writer.repaired))
            if writer.num_episodes:
                console.print(f"Adds to {writer.root}; episodes there: {writer.num_episodes}")
            recording = Recording(config, env, writer, people, displays)
            if interactive or env.real:
                console.print("Getting ready; the first time on a computer takes about a minute.")
                recording.warm_up(config.seed)
                console.print("Ready.")
            log = RecordingLog()
            _record_all(config, recording, writer, log, console)
            report(config, writer.root, writer.num_episodes, writer.num_frames, log, console)
    finally:
        for display in [*displays, *people]:
            display.close()
        env.close()
        if link:
            link.close()
    return log.exit_code


def _opened(config: RecordConfig, interactive: bool) -> tuple[HandrailEnv, Any]:
    """Return the environment; and the link to a robot, if it is no simulation."""
    if not config.robot_client:
        return build_env(config, config.dataset.fps, render=interactive), None
    from handrail.collect.lekiwi.client_plant import open_client  # loads LeRobot

    return open_client(config)


def _record_all(
    config: RecordConfig, recording: Recording, writer: EpisodeWriter, log: RecordingLog, console: Terminal
) -> None:
    """Record until the number is reached, the operator interrupts, or the disk or an encoder fails."""
    with recording_bar(console, recording.people) as progress, Interrupts() as interrupts:
        bar = progress.add_task("recording", total=config.dataset.num_episodes, success="–")

        def tell_paused(paused: bool) -> None:
            progress.update(bar, description="paused" if paused else "recording")

        try:
            while len(log.outcomes) < config.dataset.num_episodes:
                seed = episode_seed(config.seed, writer.num_episodes, log.attempt)
                outcome = recording.episode(seed, interrupts, tell_paused, log.add)
                if outcome.ended_by is EpisodeEvent.QUIT:
                    break
                progress.update(bar, completed=len(log.outcomes), description="recording", success=log.words)
        except KeyboardInterrupt:
            log.trouble, log.exit_code = (
                "interrupted; the open episode is dropped, the saved ones are whole",
                INTERRUPTED,
            )
        except HandrailError as error:
            log.trouble, log.exit_code = str(error), FAILED


def _displays(config: RecordConfig, console: Terminal) -> list[Display]:
    spawn, web, save = config.display_data, config.display_web, config.display_save
    if not (spawn or web or save):
        return []
    return [Display(spawn, web, save, say=console.print)]


def _people(config: RecordConfig, env: HandrailEnv, console: Terminal) -> list[Any]:
    """Return whoever steers now at this computer, if the settings say so."""
    spec = OPERATORS.find(config.operator)
    if not spec.interactive:
        return []
    return [resolved(spec.build)(config, env, console.print)]
