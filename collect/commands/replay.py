"""Replays a recorded episode's commands and reports how far the motion deviates."""

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handrail.collect.commands.config import ReplayConfig
from handrail.collect.session.build import build_env
from handrail.collect.session.film import VideoFile
from handrail.collect.session.recorded import recorded_settings
from handrail.collect.world.env import HandrailEnv, Observation
from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.command import Command
from handrail.datasets.format.metadata import CLIENT
from handrail.datasets.presentation.table import Table
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.reading.reader import OpenDataset, open_dataset
from handrail.datasets.recording.slice import TRIMMED

_HEADINGS = ("episode", "largest deviation", "of", "tool at end [m]", "success", "recorded", "contacts begun")
_MOST_TRIMMED = 100_000  # frames; more is a number made up
_BLIND = {"cameras": ""}
Pictures = list[NDArray[np.uint8]]


@dataclass(frozen=True)
class Replay:
    """The result of a replay."""

    episode: int
    names: tuple[str, ...]
    """Of the observed state."""
    deviations: FloatArray
    """Largest deviation of each number of the observed state over the episode, (s,)."""
    final: FloatArray
    """Deviation of each number at the end, (s,)."""
    recorded_success: bool
    success: bool
    contacts: int
    """Forbidden contacts that began now."""
    robot_client: str = ""
    """The robot of LeRobot's that was driven through its client; empty if it was none."""

    @property
    def largest(self) -> float:
        """Largest deviation of any number, in its own unit."""
        return float(np.max(self.deviations, initial=0.0))

    @property
    def tool_at_end(self) -> float:
        """Distance of the tool from where it was recorded, at the end [m]."""
        tool = [index for index, name in enumerate(self.names) if name in ("tool.x", "tool.y", "tool.z")]
        return float(np.linalg.norm(self.final[tool]))

    @property
    def cells(self) -> tuple[str, ...]:
        """Its row of the table."""
        return (
            str(self.episode),
            f"{self.largest:.2e}",
            self.names[int(self.deviations.argmax())],
            f"{self.tool_at_end:.2e}",
            "yes" if self.success else "no",
            "yes" if self.recorded_success else "no",
            str(self.contacts),
        )


def replay(config: ReplayConfig) -> None:
    """Run a recorded episode's commands again, or those of all, and print the deviation."""
    replays = list[Replay]()
    video = Path(config.video).expanduser() if config.video else None
    with open_dataset(config.dataset.folder) as dataset:
        for episode in range(len(dataset.rows)) if config.episode < 0 else [config.episode]:
            replays.append(replay_one_of(dataset, episode, video=video, said=config.said)[0])
    say = Terminal().print
    say(Table(_HEADINGS, [each.cells for each in replays]))
    for client in sorted({each.robot_client for each in replays if each.robot_client}):
        say(f"Recorded through the client of {client}: replayed here in simulation, so it deviates.")
    if config.video:
        say(f"Written: {config.video}")


def replay_episode(root: Path, episode: int, pictures: int = 0) -> tuple[Replay, Pictures]:
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
    seen: Mapping[str, Any] = _BLIND,
    observe: Callable[[Observation], None] = lambda observation: None,
) -> tuple[Replay, Pictures]:
    """Run the recorded commands of an episode of an open dataset; see `replay_episode`.

    Args:
        dataset: it.
        episode: its number.
        pictures: how many pictures to take, evenly over the episode.
        video: also film the whole episode to this .mp4 file.
        said: names of the command line, which the dataset may name as `module:name`.
        seen: settings of the cameras that are in the observations; none by default.
        observe: is told the observation of every recorded frame.
    """
    info, row = dataset.info, dataset.row(episode)
    where = f"episode {episode} of {info.root}"
    if (seed := _count(row.get("seed"))) is None:
        raise HandrailError(f"dataset {info.root}: expected one that handrail-record made, found no seed")
    frames = dataset.frames(episode, ["action", "observation.state"])
    actions, recorded = frames["action"], frames["observation.state"]
    skipped = _count(row.get(TRIMMED), _MOST_TRIMMED) or 0  # the robot stood still then
    limit = (skipped + len(actions) - 0.5) / info.fps
    config = replace(recorded_settings(row, said), time_limit=limit, **seen)
    taken, played = Pictures(), list[tuple[FloatArray, int, bool]]()
    with ExitStack() as stack:
        env = stack.enter_context(closing(build_env(config, info.fps, render=bool(pictures or video))))
        _check_state(recorded, env, where)
        film = stack.enter_context(VideoFile(video, env.render_size, info.fps)) if video else None
        moments = skipped + np.linspace(0, len(actions) - 1, pictures).round().astype(int)
        still = np.where(np.arange(actions.shape[1]) < env.model.size, np.float32(0.0), actions[0])
        actions = np.vstack([np.tile(still, (skipped, 1)), actions])
        for frame, (before, contacts, success) in enumerate(_run(env, seed, actions, info.fps)):
            if frame >= skipped:
                played.append((before["agent_pos"], contacts, success))
                observe(before)
            picture = env.render() if film or frame in moments else None
            if picture is not None and frame in moments:
                taken.append(picture)
            if picture is not None and film:
                film.add(picture)
    if not played:
        raise HandrailError(f"{where}: the task ended before the first recorded frame")
    states, (_, contacts, success) = np.array([state for state, _, _ in played]), played[-1]
    difference = np.abs(states - recorded[: len(states)])
    if env.model.description.base.joints:  # a real robot's heading begins anew at ±π
        difference[:, 2] = np.abs(np.remainder(difference[:, 2] + np.pi, 2.0 * np.pi) - np.pi)
    found = Replay(
        episode=episode,
        names=env.agent_names,
        deviations=difference.max(axis=0),
        final=difference[-1],
        recorded_success=bool(row.get("success")),
        success=success,
        contacts=contacts,
        robot_client=str(row.get(CLIENT) or ""),
    )
    return found, taken


def _count(value: Any, most: float = np.inf) -> int | None:
    """Return what a line of metadata says, if that is a whole number in its range."""
    return value if type(value) is int and 0 <= value <= most else None


def _check_state(states: np.ndarray, env: HandrailEnv, where: str) -> None:
    """Check that recorded states, (T, s), are of the robot that the episode names."""
    size, numbers = states.shape[1:], len(env.agent_names)
    if size != (numbers,) or not np.issubdtype(states.dtype, np.floating):
        raise HandrailError(
            f"{where}: expected {numbers} numbers as observation.state of {env.model.description.name}, "
            f"got {size} of {states.dtype}"
        )


def _run(
    env: HandrailEnv, seed: int, actions: np.ndarray, fps: float
) -> Iterator[tuple[Observation, int, bool]]:
    """Send the commands of an episode until it is over.

    Args:
        env: of the episode; the robot may be sent several commands a frame.
        seed: of the episode.
        actions: velocities at the ends of the frames, and grippers, (T, n + h).
        fps: frames a second.

    Yields:
        At the end of every frame what was observed at its beginning, how many contacts have begun so far, and
        whether the task is done.
    """
    onsets = contacts = 0
    observation, _ = env.reset(seed=seed)
    for action in actions:
        before = observation
        velocities, grippers = np.split(action.astype(np.float64), [env.model.size])
        last = np.array(env.state().commanded)
        command = Command(np.stack([last, velocities, np.zeros(len(last))]), 1.0 / fps)
        for step in range(1, round(env.fps / fps) + 1):
            sent = np.append(command.velocity(step * env.period), grippers)
            observation, _, terminated, truncated, info = env.step(sent)
            onsets, contacts = onsets + max(info["contacts"] - contacts, 0), info["contacts"]
            if terminated or truncated:
                yield before, onsets, bool(info["is_success"])
                return
        yield before, onsets, bool(info["is_success"])
