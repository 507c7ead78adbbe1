"""Replays a recorded episode's commands and reports how far the motion deviates."""

import contextlib
from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handrail.collect.operators.operator import View
from handrail.collect.session.build import build_env
from handrail.collect.session.film import VideoFile
from handrail.collect.session.recorded import RecordedCommands, recorded_settings
from handrail.collect.session.session import Session
from handrail.collect.world.env import HandrailEnv
from handrail.controllers.arrays import FloatArray
from handrail.controllers.entries import is_count
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.intent import Intent
from handrail.datasets.format.metadata import CLIENT
from handrail.datasets.reading.open_dataset import OpenDataset, open_dataset
from handrail.datasets.recording.frames import Frame
from handrail.datasets.recording.slice import TRIMMED

_MOST_TRIMMED = 100_000  # frames; more is a number made up


@dataclass(frozen=True)
class Replay:
    """What came out of a replay.

    Attributes:
        episode: its number.
        names: of the observed state.
        deviations: largest deviation of each number of the observed state over the episode, (s,).
        final: deviation of each number at the end, (s,).
        recorded_success: what the dataset says.
        success: what happened now.
        contacts: forbidden contacts that began now.
        robot_client: the robot of LeRobot's that was driven through its client; empty if it was none.
    """

    episode: int
    names: tuple[str, ...]
    deviations: FloatArray
    final: FloatArray
    recorded_success: bool
    success: bool
    contacts: int
    robot_client: str = ""

    @property
    def largest(self) -> float:
        """Largest deviation of any number, in its own unit."""
        return float(np.max(self.deviations, initial=0.0))

    @property
    def tool_at_end(self) -> float:
        """Distance of the tool from where it was recorded, at the end [m]."""
        tool = [index for index, name in enumerate(self.names) if name in ("tool.x", "tool.y", "tool.z")]
        return float(np.linalg.norm(self.final[tool]))


def replay_episode(root: Path, episode: int, pictures: int = 0) -> tuple[Replay, list[NDArray[np.uint8]]]:
    """Run the recorded commands of an episode in its environment, from the same seed.

    Args:
        root: folder of the dataset.
        episode: its number.
        pictures: how many pictures to take, evenly over the episode.

    Returns:
        What came out, and the pictures, (height, width, 3) each.
    """
    with open_dataset(root) as dataset:
        return replay_one_of(dataset, episode, pictures)


def replay_one_of(
    dataset: OpenDataset,
    episode: int,
    pictures: int = 0,
    video: Path | None = None,
    said: Collection[str] = (),
) -> tuple[Replay, list[NDArray[np.uint8]]]:
    """Run the recorded commands of an episode of an open dataset; see `replay_episode`.

    Args:
        dataset: it.
        episode: its number.
        pictures: how many pictures to take, evenly over the episode.
        video: also film the whole episode to this .mp4 file.
        said: names of the command line, which the dataset may name as `module:name`.
    """
    info, row = dataset.info, _row(dataset, episode)
    frames = dataset.frames(episode, ["action", "observation.state"])
    length = len(frames["action"])
    skipped = _trimmed(row)  # the operator did nothing then, so the robot stands still
    limit = (skipped + length - 0.5) / info.fps
    config = replace(recorded_settings(row, said), cameras="", time_limit=limit)
    env = build_env(config, info.fps, render=bool(pictures or video))
    with contextlib.ExitStack() as stack:
        stack.callback(env.close)
        _check_state(frames["observation.state"], env, f"episode {episode} of {info.root}")
        film = stack.enter_context(VideoFile(video, env.render_size, info.fps)) if video else None
        moments = {skipped + each for each in _moments(length, pictures)}
        camera, period = _Camera(moments, film), 1.0 / info.fps
        recorded = RecordedCommands(_from_the_start(frames["action"], skipped), period)
        session = Session(env, recorded, _Nobody(), [camera], control_period=period, record_period=period)
        outcome = session.run(row["seed"])
    states = camera.states[skipped:]
    if not states:
        raise HandrailError(
            f"episode {episode} of {info.root}: the task ended before the first recorded frame"
        )
    difference = np.abs(states - frames["observation.state"][: len(states)])
    replay = Replay(
        episode=episode,
        names=env.agent_names,
        deviations=difference.max(axis=0),
        final=difference[-1],
        recorded_success=bool(row.get("success")),
        success=outcome.success,
        contacts=outcome.contact_onsets,
        robot_client=str(row.get(CLIENT) or ""),
    )
    return replay, camera.taken


def _row(dataset: OpenDataset, episode: int) -> dict[str, Any]:
    row = dataset.row(episode)
    if not is_count(row.get("seed")):
        raise HandrailError(
            f"dataset {dataset.info.root}: expected one that handrail-record made, found no seed"
        )
    return row


def _trimmed(row: dict[str, Any]) -> int:
    """Return how many frames `handrail-edit trim` has cut off at the beginning."""
    cut = row.get(TRIMMED)
    return cut if is_count(cut) and cut <= _MOST_TRIMMED else 0


def _from_the_start(actions: np.ndarray, skipped: int) -> np.ndarray:
    """Return actions, (T, n + 1), after some in which the robot stands still."""
    still = np.append(np.zeros(actions.shape[1] - 1), actions[0, -1]).astype(actions.dtype)
    return np.vstack([np.tile(still, (skipped, 1)), actions])


def _check_state(states: np.ndarray, env: HandrailEnv, where: str) -> None:
    """Check that recorded states, (T, s), are of the robot that the episode names."""
    size, numbers = states.shape[1:], len(env.agent_names)
    if size != (numbers,) or not np.issubdtype(states.dtype, np.floating):
        raise HandrailError(
            f"{where}: expected {numbers} numbers as observation.state of {env.model.description.name}, "
            f"got {size} of {states.dtype}"
        )


class _Nobody:
    """Asks for nothing; an operator."""

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin an episode."""

    def act(self, view: View) -> Intent:
        """Return the intent of who touches nothing."""
        return Intent(np.zeros(0), np.zeros(0, dtype=bool))


def _moments(frames: int, pictures: int) -> set[int]:
    """Return the frames of which pictures are taken, evenly over the episode."""
    return set(np.linspace(0, frames - 1, pictures).round().astype(int).tolist())


class _Camera:
    """Keeps the states, takes pictures at some moments, and films if there is a file; an observer."""

    def __init__(self, moments: set[int], film: VideoFile | None) -> None:
        self._moments, self._film = moments, film
        self.taken: list[NDArray[np.uint8]] = []
        self.states: list[FloatArray] = []

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Take note of the environment."""
        self._env = env

    def see(self, frame: Frame) -> None:
        """Keep the state, and take the picture of this moment, if somebody wants it."""
        wanted = len(self.states) in self._moments
        self.states.append(frame.state)
        picture = self._env.render() if wanted or self._film else None
        if picture is None:
            return
        if wanted:
            self.taken.append(picture)
        if self._film:
            self._film.add(picture)
