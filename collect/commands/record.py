"""Records episodes into a dataset, with a progress bar, and says what came of it."""

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from handrail.collect.commands.interrupts import Interrupts
from handrail.collect.commands.progress import recording_bar
from handrail.collect.commands.recording import Recording, come_first, open_writer
from handrail.collect.commands.target import located, next_commands
from handrail.collect.config import RecordConfig
from handrail.collect.envs.env import HandrailEnv
from handrail.collect.operators.catalogue import OPERATORS
from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.session.build import build_env, build_modes, build_session
from handrail.collect.session.display import Display
from handrail.collect.session.outcome import Outcome
from handrail.controllers.errors import HandrailError
from handrail.controllers.registry import resolved
from handrail.datasets.editing.pack_config import packing_advice
from handrail.datasets.format.layout import Layout
from handrail.datasets.recording.folder import check_target
from handrail.datasets.recording.writer import EpisodeWriter

INTERRUPTED = 130
FAILED = 1
_DROPPED: dict[EpisodeEvent | None, str] = {
    None: "practice",
    EpisodeEvent.DISCARD: "thrown away",
    EpisodeEvent.RESTART: "begun again",
    EpisodeEvent.QUIT: "not finished",
}
PLAIN: dict[str, Any] = {"highlight": False, "markup": False, "soft_wrap": True}


@dataclass
class _Log:
    """What has been recorded in this run, and what the operator did not want to keep."""

    outcomes: list[Outcome] = field(default_factory=list)
    dropped: list[Outcome] = field(default_factory=list)
    attempt: int = 0
    trouble: str = ""
    exit_code: int = 0

    def add(self, outcome: Outcome) -> None:
        """Count an episode; one thrown away is tried again elsewhere, one begun again is not."""
        (self.outcomes if outcome.kept else self.dropped).append(outcome)
        another = outcome.practice or outcome.ended_by is EpisodeEvent.DISCARD
        self.attempt = 0 if outcome.kept else self.attempt + another

    @property
    def words(self) -> str:
        """How it stands."""
        successes = sum(outcome.success for outcome in self.outcomes)
        counts = Counter(None if outcome.practice else outcome.ended_by for outcome in self.dropped)
        dropped = (f", {counts[event]} {word}" for event, word in _DROPPED.items() if counts[event])
        return f"{successes}/{len(self.outcomes)} succeeded" + "".join(dropped)


def record(config: RecordConfig) -> int:
    """Record as configured; return the exit code: 0, 1 after a failure, 130 after Ctrl-C.

    Args:
        config: of the recording.

    Raises:
        HandrailError: a setting is wrong; nothing has been written then.
    """
    console = Console(stderr=True)
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
        with open_writer(config, env) as writer:
            if writer.repaired and not writer.repaired.clean:
                console.print(str(writer.repaired), **PLAIN)
            recording = Recording(config, env, writer, people, displays)
            if interactive or env.real:
                console.print("Getting ready; the first time on a computer takes about a minute.", **PLAIN)
                recording.warm_up(config.seed)
                console.print("Ready.", **PLAIN)
            log = _Log()
            _record_all(config, recording, writer, log, console)
            _report(config, writer, log, console)
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
    from handrail.collect.lekiwi.client_env import open_client  # loads LeRobot

    return open_client(config)


def episode_seed(seed: int, episode: int, attempt: int = 0) -> int:
    """Return the seed of an episode: far apart for every seed and number.

    Args:
        seed: of the recording.
        episode: its number.
        attempt: how many with this number the operator has thrown away.
    """
    return int(np.random.SeedSequence([seed, episode, attempt]).generate_state(1)[0])


def _record_all(
    config: RecordConfig, recording: Recording, writer: EpisodeWriter, log: _Log, console: Console
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


def _report(config: RecordConfig, writer: EpisodeWriter, log: _Log, console: Console) -> None:
    if log.trouble:
        console.print(f"error: {log.trouble}", style="bold red", **PLAIN)
    if log.outcomes:
        console.print(_summary(config, log))
    for outcome in log.dropped:
        why = _DROPPED[None if outcome.practice else outcome.ended_by]
        console.print(f"not saved: {why}, seed {outcome.seed}", **PLAIN)
    console.print(
        f"{writer.num_episodes} episodes, {writer.num_frames} frames in {writer.root}",
        highlight=False,
        soft_wrap=True,
    )
    if advice := packing_advice(writer.root):
        console.print(advice, **PLAIN)
    if OPERATORS.find(config.operator).interactive and writer.num_episodes:
        console.print(next_commands(writer.root), **PLAIN)


def _summary(config: RecordConfig, log: _Log) -> Table:
    outcomes = log.outcomes
    simulated = sum(outcome.seconds for outcome in outcomes)
    wall = sum(outcome.wall_time for outcome in outcomes)
    distance = min(outcome.smallest_distance for outcome in outcomes)
    contacts = sum(outcome.contacts for outcome in outcomes)
    periods = sum(outcome.contact_periods for outcome in outcomes)
    rows = {
        "task, mode": f"{config.task}, {config.mode_name}",
        "success": log.words,
        "recorded": f"{simulated:.1f} s in {wall:.1f} s: {simulated / wall:.1f} × real time",
        "smallest distance": f"{distance:.3f} m",
        "contacts begun": f"{contacts}, {periods} periods in contact",
        "braked updates": str(sum(outcome.brakes for outcome in outcomes)),
    }
    spent = {part: sum(outcome.spent.get(part, 0.0) for outcome in outcomes) for part in outcomes[0].spent}
    frames = sum(outcome.frames for outcome in outcomes)
    rows["time a frame"] = ", ".join(f"{part} {1e3 * time / frames:.2f} ms" for part, time in spent.items())
    table = Table(show_header=False, box=None)
    for name, value in rows.items():
        table.add_row(name, value)
    return table


def _displays(config: RecordConfig, console: Console) -> list[Display]:
    spawn, web, save = config.display_data, config.display_web, config.display_save
    if not (spawn or web or save):
        return []
    return [Display(spawn, web, save, say=lambda words: console.print(words, **PLAIN))]


def _people(config: RecordConfig, env: HandrailEnv, console: Console) -> list[Any]:
    """Return whoever steers now at this computer, if the settings say so."""
    spec = OPERATORS.find(config.operator)
    if not spec.interactive:
        return []
    return [resolved(spec.build)(config, env, lambda words: console.print(words, **PLAIN))]
