"""Replays a recorded episode's commands and reports how far the motion deviates."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handrail.collect.build import build_env
from handrail.collect.env import HandrailEnv
from handrail.collect.recorded_settings import recorded_settings
from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.datasets.quality.safety import contacts_begun
from handrail.datasets.reader import read_episodes, read_frames, read_info


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
    """

    episode: int
    names: tuple[str, ...]
    deviations: FloatArray
    final: FloatArray
    recorded_success: bool
    success: bool
    contacts: int

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

    Raises:
        HandrailError: no such dataset or episode, or one that Handrail did not record.
    """
    info = read_info(root)
    row = _row(root, episode)
    config = replace(recorded_settings(row), cameras="")
    frames = read_frames(root, episode, ["action", "observation.state"])
    env = build_env(config, info.fps, render=pictures > 0)
    try:
        states, last, taken = _run(env, row["seed"], frames["action"], pictures)
    finally:
        env.close()
    difference = np.abs(states - frames["observation.state"])
    replay = Replay(
        episode=episode,
        names=env.agent_names,
        deviations=difference.max(axis=0),
        final=difference[-1],
        recorded_success=bool(row.get("success")),
        success=bool(last["is_success"]),
        contacts=last["contacts_begun"],
    )
    return replay, taken


def _row(root: Path, episode: int) -> dict[str, Any]:
    rows = read_episodes(root)
    if not 0 <= episode < len(rows):
        raise HandrailError(f"--episode {episode}: expected one of 0 to {len(rows) - 1} in {root}")
    row = rows[episode]
    if not isinstance(row.get("seed"), int):
        raise HandrailError(f"dataset {root}: expected one that handrail-record made, found no seed")
    return row


def _run(
    env: HandrailEnv, seed: int, actions: np.ndarray, pictures: int
) -> tuple[np.ndarray, dict[str, Any], list[NDArray[np.uint8]]]:
    """Return the observed states before each action, (T, s), the last info, and pictures."""
    observation, info = env.reset(seed=seed)
    moments = set(np.linspace(0, len(actions) - 1, pictures).round().astype(int).tolist())
    states, taken, contacts = [], [], []
    for index, action in enumerate(actions):
        states.append(observation["agent_pos"])
        observation, _, _, _, info = env.step(action)
        contacts.append(info["contacts"])
        picture = env.render() if index in moments else None
        if picture is not None:
            taken.append(picture)
    return np.array(states), info | {"contacts_begun": int(contacts_begun(contacts))}, taken
