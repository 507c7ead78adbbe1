"""A session whose episodes become a dataset: what `handrail-record` and a user study share."""

import json
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import asdict, replace
from functools import cached_property
from typing import Any

from handrail.collect.config import FoundDatasetConfig, RecordConfig
from handrail.collect.operators.operator import EpisodeEvent, Operator
from handrail.collect.seeds import episode_seed
from handrail.collect.session.build import build_env, build_modes, build_session, session_features
from handrail.collect.session.outcome import Outcome
from handrail.collect.session.recorded import COLUMN as SETTINGS
from handrail.collect.session.recorded import settings_json
from handrail.collect.session.recorder import OUTCOME, Recorder
from handrail.collect.session.rehearsal import Rehearsal
from handrail.collect.world.env import HandrailEnv
from handrail.controllers.errors import HandrailError
from handrail.controllers.interrupts import Interrupts
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.versions import SIMULATION, versions
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.metadata import CLIENT, Scalar
from handrail.datasets.reading.reader import read_episodes
from handrail.datasets.recording.folder import is_dataset
from handrail.datasets.recording.writer import EpisodeWriter

_TRIES = 100  # folders
_NICE = -10  # of a loop that a person steers, where the system allows that


def come_first() -> None:
    """Let other programs wait for this one and its threads to come, where the system allows that."""
    os.environ.setdefault("LP_NUM_THREADS", "0")  # without a graphics card, Mesa draws in the loop's thread
    with suppress(AttributeError, OSError):
        os.setpriority(os.PRIO_PROCESS, 0, _NICE)


class Recording:
    """Runs episodes and saves those that are to be kept; `into` says where.

    Args:
        config: of the recording.
        env: of the recording.
        person: whoever steers now at this computer; None where a script does.
        displays: what else watches, and hears how episodes went.
        share: returns who steers where a policy drives beside them.

    Attributes:
        columns: what the metadata of the episodes to come says of the session; may change between two.
    """

    def __init__(
        self,
        config: RecordConfig,
        env: HandrailEnv,
        person: Any = None,
        displays: Sequence[Any] = (),
        share: Callable[[Operator], Operator] | None = None,
    ) -> None:
        self._config, self._env, self._person = config, env, person
        self.columns = session_columns(config)
        self._recorder = Recorder(config.dataset.single_task or env.task.description, self.columns)
        self._observers = [each for each in (self._recorder, *displays, person) if each]
        self._session = build_session(config, env, self._observers, config.dataset.fps, person, share)

    def into(self, writer: EpisodeWriter) -> None:
        """Save the episodes to come in a dataset; one whose episodes lack a column of theirs is refused."""
        if new := [name for name in (*self.columns, *OUTCOME) if not writer.has_column(name)]:
            raise HandrailError(
                f"--resume: cannot add to {str(writer.root)!r}: its episodes have no {new[0]!r}; record into"
                " another folder, and put both together with handrail-edit merge"
            )
        self._recorder.writer = writer

    def warm_up(self, seed: int) -> None:
        """Compile what an update needs, before somebody waits for it in real time; no robot moves."""
        rehearsal = Rehearsal(self._env.model, build_modes(self._config, self._env))
        unseen = {"operator": rehearsal, "observers": (), "realtime": False}
        if not self._env.real:
            replace(self._session, **unseen).run(seed)
            return
        config, fps = replace(self._config, cameras=""), self._config.dataset.fps
        with closing(build_env(config, fps)) as simulated:
            session = build_session(config, simulated, (), fps, self._person)
            replace(session, **unseen).run(seed)

    def episode(
        self, seed: int, interrupts: Interrupts, note: Callable[[Outcome], None] = lambda outcome: None
    ) -> Outcome:
        """Run one episode and save it, if it is to be kept.

        Args:
            seed: of the episode.
            interrupts: that wait until it is saved.
            note: is told how it went, before an interrupt takes effect.
        """
        outcome = self._session.run(seed)
        outcome = replace(outcome, practice=bool(self._person and self._person.person.practises))
        with interrupts.deferred():
            for observer in self._observers:
                observer.end(outcome)
            note(outcome)
        return outcome

    def episodes(
        self,
        writer: EpisodeWriter,
        wanted: int,
        note: Callable[[Outcome], None] = lambda outcome: None,
        first: int = 0,
    ) -> Iterator[Outcome]:
        """Record until a dataset has so many episodes, or the operator quits; yield how each went.

        What an episode is depends on its number alone, whoever records it.

        Args:
            writer: of the dataset.
            wanted: how many episodes it has in the end.
            note: is told how an episode went, before an interrupt takes effect.
            first: number of its first episode in the whole of which it is a part.
        """
        self.into(writer)
        attempt = 0  # how many of the next number were thrown away; one begun again is the same one
        with Interrupts() as interrupts:
            while writer.num_episodes < wanted:
                seed = episode_seed(self._config.seed, first + writer.num_episodes, attempt)
                if seed in self._moved:
                    attempt += 1
                    continue
                outcome = self.episode(seed, interrupts, note)
                another = outcome.practice or outcome.ended_by is EpisodeEvent.DISCARD
                attempt = 0 if outcome.kept else attempt + another
                yield outcome
                if outcome.ended_by is EpisodeEvent.QUIT:
                    return

    @cached_property
    def _moved(self) -> set[Any]:
        """Seeds of the dataset's episodes that an edit gave other numbers: none is recorded again."""
        root, seed = self._config.dataset.folder, self._config.seed
        rows = read_episodes(root) if is_dataset(Layout(root)) else []
        return {row.get("seed") for n, row in enumerate(rows) if row.get("seed") != episode_seed(seed, n)}


def session_columns(config: RecordConfig) -> dict[str, Scalar]:
    """Return what every episode's metadata says of the session: what one asks for most, and all settings."""
    columns: dict[str, Scalar] = {
        "environment": config.task,
        "robot": config.robot,
        "operator": config.operator,
        "mode": config.mode_name,
        "noise": config.noise,
        "person": config.person,
        "participant": "",  # of a user study
        SETTINGS: settings_json(config),
    }
    if config.robot_client:
        columns[CLIENT] = config.robot_client + (" (simulated)" if config.client.simulated else "")
    if config.policy:
        names = [os.path.basename(each.rstrip("/")) for each in config.policy]
        shared = {"arbiter": config.arbiter, "policies": names} | asdict(config.arbitration)
        columns["shared"] = json.dumps(shared)
    return columns


def open_writer(config: RecordConfig, env: HandrailEnv) -> EpisodeWriter:
    """Return the writer of a recording's dataset, new or resumed."""
    dataset, features = config.dataset, session_features(env, bool(config.policy))
    robot = env.model.description.name
    manifest = Manifest(dataset.name, dataset.fps, robot, features, versions(*SIMULATION))
    known = ROBOTS.get(robot)
    if known and config.robot.endswith(".toml") and not known.file.samefile(os.path.expanduser(config.robot)):
        words = f"expected a name of its own, got {known.name!r}: policies would drive that robot"
        raise HandrailError(f"--robot {config.robot}: {words}")
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


def located(config: RecordConfig, env: HandrailEnv) -> RecordConfig:
    """Return the settings of a recording with its folder, and whether it adds to a dataset that is there."""
    if not isinstance(config.dataset, FoundDatasetConfig):
        return config
    if config.dataset.is_found:
        return _found(config, env)
    is_there = is_dataset(Layout(config.dataset.folder.absolute()))
    return _resumed(config, env) if is_there and not (config.resume or config.overwrite) else config


def _resumed(config: RecordConfig, env: HandrailEnv) -> RecordConfig:
    """Return the settings that add to the dataset that is there."""
    resumed = replace(config, resume=True)
    open_writer(resumed, env).close()
    return resumed


def _found(config: RecordConfig, env: HandrailEnv) -> RecordConfig:
    """Return the settings with the first folder that fits, where nobody said one.

    That is `outputs/cockpit/TASK` or the next one with a number: one that is free, or to which these episodes
    can be added.
    """
    first = config.dataset.folder / config.task.replace(":", "_")
    for folder in (first, *(first.with_name(f"{first.name}-{number}") for number in range(2, _TRIES))):
        there = replace(config, dataset=replace(config.dataset, place=str(folder)))
        if config.overwrite or not folder.exists():
            return there
        with suppress(HandrailError):
            return _resumed(there, env)
    raise HandrailError(f"no folder for the dataset beside {str(first)!r}: say one")
