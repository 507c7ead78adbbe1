"""A session whose episodes become a dataset: what `handrail-record` and a user study share."""

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from handrail.collect.config import RecordConfig
from handrail.collect.session.build import (
    build_env,
    build_modes,
    build_session,
    session_features,
)
from handrail.collect.session.outcome import Outcome
from handrail.collect.session.recorded import COLUMN as SETTINGS
from handrail.collect.session.recorded import settings_json
from handrail.collect.session.recorder import Recorder
from handrail.collect.session.rehearsal import Rehearsal
from handrail.collect.session.session import Observer
from handrail.collect.world.env import HandrailEnv
from handrail.controllers.interrupts import Interrupts
from handrail.controllers.versions import SIMULATION, versions
from handrail.datasets.format.columns import CLIENT, Scalar
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.recording.writer import EpisodeWriter

_NICE = -10  # of a loop that a person steers, where the system allows that


def come_first() -> None:
    """Let other programs wait for this one and its threads to come, where the system allows that."""
    with suppress(AttributeError, OSError):
        os.setpriority(os.PRIO_PROCESS, 0, _NICE)


class EpisodeObserver(Observer, Protocol):
    """An observer of a session that also hears how episodes went."""

    def end(self, outcome: Outcome) -> None:
        """Take note of how the episode went."""
        ...


class Recording:
    """Runs episodes and saves those that are to be kept.

    Args:
        config: of the recording.
        env: of the recording.
        writer: of the dataset.
        people: whoever steers now at this computer; none where a script does.
        displays: what else watches.

    Attributes:
        people: whoever steers.
        columns: what the metadata of the episodes to come says of the session; may change between two.
    """

    def __init__(
        self,
        config: RecordConfig,
        env: HandrailEnv,
        writer: EpisodeWriter,
        people: Sequence[Any] = (),
        displays: Sequence[EpisodeObserver] = (),
    ) -> None:
        self.columns = session_columns(config)
        task = config.dataset.single_task or env.task_description
        self._recorder = Recorder(writer, task, self.columns)
        self.people = people
        self._observers: list[EpisodeObserver] = [self._recorder, *displays, *people]
        self._session = build_session(config, env, self._observers, config.dataset.fps, *people)
        self._rehearsal = Rehearsal(env.model, build_modes(config, env))
        self._config, self._real = replace(config, cameras=""), env.real

    def into(self, writer: EpisodeWriter) -> None:
        """Save the episodes to come in another dataset."""
        self._recorder.writer = writer

    def warm_up(self, seed: int) -> None:
        """Compile what an update needs, before somebody waits for it in real time; no robot moves."""
        if not self._real:
            self._session.warm_up(seed, self._rehearsal)
            return
        fps = self._config.dataset.fps
        with closing(build_env(self._config, fps)) as simulated:
            build_session(self._config, simulated, (), fps, *self.people).warm_up(seed, self._rehearsal)

    def episode(
        self,
        seed: int,
        interrupts: Interrupts,
        tell_paused: Callable[[bool], None] = lambda paused: None,
        note: Callable[[Outcome], None] = lambda outcome: None,
    ) -> Outcome:
        """Run one episode and save it, if it is to be kept.

        Args:
            seed: of the episode.
            interrupts: that wait until it is saved.
            tell_paused: is told when the operator pauses, and when they go on.
            note: is told how it went, before an interrupt takes effect.
        """
        outcome = self._session.run(seed, tell_paused)
        outcome = replace(outcome, practice=any(each.practises for each in self.people))
        with interrupts.deferred():
            for observer in self._observers:
                observer.end(outcome)
            note(outcome)
        return outcome


def episode_seed(seed: int, episode: int, attempt: int = 0) -> int:
    """Return the seed of an episode: far apart for every seed and number.

    Args:
        seed: of the recording.
        episode: its number.
        attempt: how many with this number the operator has thrown away.
    """
    return int(np.random.SeedSequence([seed, episode, attempt]).generate_state(1)[0])


def session_columns(config: RecordConfig) -> dict[str, Scalar]:
    """Return what every episode's metadata says of the session: what one asks for most, and all settings."""
    return {
        "environment": config.task,
        "robot": config.robot,
        "operator": config.operator,
        "mode": config.mode_name,
        "noise": config.noise,
        "person": config.person,
        "participant": "",  # of a user study
        SETTINGS: settings_json(config),
    } | ({CLIENT: _client(config)} if config.robot_client else {})


def _client(config: RecordConfig) -> str:
    """Return which robot of LeRobot's is driven, and whether its host is a simulation."""
    return config.robot_client + (" (simulated)" if config.client.simulated else "")


def open_writer(config: RecordConfig, env: HandrailEnv) -> EpisodeWriter:
    """Return the writer of a recording's dataset, new or resumed."""
    dataset, manifest = config.dataset, manifest_of(config, env)
    if config.resume:
        return EpisodeWriter.resume(dataset.folder, manifest, config.verify)
    return EpisodeWriter.create(dataset.folder, manifest, config.overwrite)


@contextmanager
def session_writer(config: RecordConfig, env: HandrailEnv) -> Iterator[EpisodeWriter]:
    """Open the writer of a recording's dataset; a session without episodes leaves nothing behind."""
    root = config.dataset.folder.absolute()
    made = [folder for folder in (root, *root.parents) if not folder.exists()]
    try:
        with open_writer(config, env) as writer:
            try:
                yield writer
            finally:
                writer.erase_if_empty()
    finally:
        for folder in made:
            with suppress(OSError):  # something is in it
                folder.rmdir()


def manifest_of(config: RecordConfig, env: HandrailEnv) -> Manifest:
    """Return the schema of a recording's dataset."""
    dataset = config.dataset
    return Manifest(
        dataset.name, dataset.fps, env.model.description.name, session_features(env), versions(*SIMULATION)
    )
