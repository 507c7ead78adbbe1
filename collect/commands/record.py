"""Records episodes into a dataset, with a progress bar, and says what came of it."""

import contextlib
import signal
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from types import FrameType
from typing import Any, Self

import numpy as np
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table

from handrail.collect.config import RecordConfig
from handrail.collect.envs.env import HandrailEnv
from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.session.build import build_env, build_session, session_features, software_versions
from handrail.collect.session.display import Display
from handrail.collect.session.outcome import Outcome
from handrail.collect.session.recorded_settings import COLUMN as SETTINGS
from handrail.collect.session.recorded_settings import settings_json
from handrail.collect.session.recorder import Recorder
from handrail.collect.session.session import Session
from handrail.controllers.errors import HandrailError
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.recording.writer import EpisodeWriter

INTERRUPTED = 130
FAILED = 1
_DROPPED: dict[EpisodeEvent | None, str] = {
    EpisodeEvent.DISCARD: "thrown away",
    EpisodeEvent.RESTART: "begun again",
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
        self.attempt = 0 if outcome.kept else self.attempt + (outcome.ended_by is EpisodeEvent.DISCARD)

    @property
    def words(self) -> str:
        """How it stands."""
        successes = sum(outcome.success for outcome in self.outcomes)
        counts = Counter(outcome.ended_by for outcome in self.dropped)
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
    env = build_env(config, config.dataset.fps)
    displays: list[Display] = []
    try:
        displays = _displays(config, console)
        build_session(config, env)  # a wrong mask, or cameras without GL, show before anything is written
        env.reset(seed=config.seed)
        with _open_writer(config, env) as writer:
            if writer.repaired and not writer.repaired.clean:
                console.print(str(writer.repaired), **PLAIN)
            task = config.dataset.single_task or env.task_description
            recorder = Recorder(writer, task, _session_columns(config))
            session = build_session(config, env, [*displays, recorder], config.dataset.fps)
            log = _Log()
            _record_all(config, session, recorder, writer, log, console)
            _report(config, writer, log, console)
    finally:
        for display in displays:
            display.close()
        env.close()
    return log.exit_code


def episode_seed(seed: int, episode: int, attempt: int = 0) -> int:
    """Return the seed of an episode: far apart for every seed and number.

    Args:
        seed: of the recording.
        episode: its number.
        attempt: how many with this number the operator has thrown away.
    """
    return int(np.random.SeedSequence([seed, episode, attempt]).generate_state(1)[0])


def _session_columns(config: RecordConfig) -> dict[str, str | float]:
    """Return what every episode's metadata says of the session: what one asks for most, and all settings."""
    return {
        "environment": config.task,
        "robot": config.robot,
        "operator": config.operator,
        "mode": config.mode_name,
        "noise": config.noise,
        "person": config.person,
        SETTINGS: settings_json(config),
    }


def _open_writer(config: RecordConfig, env: HandrailEnv) -> EpisodeWriter:
    dataset = config.dataset
    manifest = Manifest(
        dataset.name, dataset.fps, env.model.description.name, session_features(env), software_versions()
    )
    if config.resume:
        return EpisodeWriter.resume(dataset.folder, manifest, config.verify)
    return EpisodeWriter.create(dataset.folder, manifest, config.overwrite)


def _record_all(
    config: RecordConfig,
    session: Session,
    recorder: Recorder,
    writer: EpisodeWriter,
    log: _Log,
    console: Console,
) -> None:
    """Record until the number is reached, the operator interrupts, or the disk or an encoder fails."""
    with _progress(console) as progress, _Interrupts() as interrupts:
        bar = progress.add_task("recording", total=config.dataset.num_episodes, success="–")

        def tell_paused(paused: bool) -> None:
            progress.update(bar, description="paused" if paused else "recording")

        try:
            while len(log.outcomes) < config.dataset.num_episodes:
                seed = episode_seed(config.seed, writer.num_episodes, log.attempt)
                outcome = session.run(seed, tell_paused)
                with interrupts.deferred():
                    recorder.save(outcome)
                    log.add(outcome)
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
        console.print(f"not saved: {_DROPPED[outcome.ended_by]}, seed {outcome.seed}", **PLAIN)
    console.print(
        f"{writer.num_episodes} episodes, {writer.num_frames} frames in {writer.root}",
        highlight=False,
        soft_wrap=True,
    )


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


def _progress(console: Console) -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[success]}"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=console,
    )


class _Interrupts:
    """Ends a recording on Ctrl-C or SIGTERM: at once between saves, after it during one."""

    _SIGNALS = (signal.SIGINT, signal.SIGTERM)

    def __enter__(self) -> Self:
        self._deferring = self._asked = False
        self._previous = {number: signal.signal(number, self._interrupt) for number in self._SIGNALS}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._previous.items():
            signal.signal(number, handler)

    @contextlib.contextmanager
    def deferred(self) -> Iterator[None]:
        """Let the block finish before an interrupt takes effect."""
        self._deferring = True
        try:
            yield
        finally:
            self._deferring = False
        if self._asked:
            raise KeyboardInterrupt

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        self._asked = True
        if not self._deferring:
            raise KeyboardInterrupt
