"""Recorded episodes as a fit needs them: what the operator saw, and how far they pushed the inputs."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from handrail.collect.config import SessionConfig
from handrail.collect.envs.env import HandrailEnv
from handrail.collect.operators.devices.input_map import StickMap
from handrail.collect.operators.human.human import HumanSettings
from handrail.collect.operators.human.motion_goal import MotionGoal
from handrail.collect.operators.human.steering import Gains
from handrail.collect.operators.modes import MASK, MODES, TeleopMode
from handrail.collect.operators.operator import View
from handrail.collect.operators.scripts.scripted import gains_of, script_of
from handrail.collect.session.build import build_env, build_mode
from handrail.collect.session.recorded_commands import RecordedCommands
from handrail.collect.session.recorded_settings import recorded_settings
from handrail.collect.session.session import Session
from handrail.collect.tasks.catalogue import TASKS
from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.entries import is_count
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.model import RobotModel
from handrail.datasets.format.data_file import data_files
from handrail.datasets.reading.reader import read_episodes, read_info, read_rows_of
from handrail.datasets.recording.piece import TRIMMED

_COLUMNS = ("action", "teleop.values", "teleop.mask", "teleop.raw", "teleop.mode", "teleop.device")
_SHORTEST = 1.5  # an episode that says anything [s]
STICKS = "sticks"


@dataclass(frozen=True)
class Steered:
    """One recorded episode.

    Attributes:
        name: which.
        participant: who steered; "" where nobody was asked.
        device: what they held; "" for a script.
        keys: whether every input was on or off.
        fps: frames a second [Hz].
        model: of the robot.
        mode: the teleop mode.
        gains: full stick, at the speed level that they chose.
        views: what they saw, frame by frame, from where they began to steer.
        goals: what the task's script wants at these views.
        inputs: how far each channel was pushed, over full stick, (T, m).
        owned: which channels were theirs, (T, m).
    """

    name: str
    participant: str
    device: str
    keys: bool
    fps: int
    model: RobotModel
    mode: TeleopMode
    gains: Gains
    views: tuple[View, ...]
    goals: tuple[MotionGoal, ...]
    inputs: FloatArray
    owned: BoolArray


def read_steered(root: Path, participant: str = "", device: str = "") -> Iterator[Steered | str]:
    """Yield the episodes of a dataset, or why one is left out.

    Args:
        root: folder of the dataset.
        participant: only who is called so; "" takes everyone.
        device: only what was steered with this; "" takes every device.

    Raises:
        HandrailError: there is no dataset, or Handrail did not record it.
    """
    info = read_info(root)
    missing = [name for name in _COLUMNS if name not in info.features]
    if missing:
        raise HandrailError(f"dataset {str(root)!r}: expected the column {missing[0]!r} of handrail-record")
    with data_files() as files:
        for row in read_episodes(root):
            name = f"{root.name}, episode {row['episode_index']}"
            if participant and row.get("participant") != participant:
                continue
            frames = read_rows_of(info, row, _COLUMNS, files)
            held = Counter(frames["teleop.device"].tolist()).most_common(1)[0][0]
            if device and held != device:
                continue
            reason = _unfit(row, frames, info.fps)
            yield f"{name}: {reason}" if reason else _steered(name, row, frames, info.fps, held)


def check_alike(episodes: Sequence[Steered]) -> None:
    """Check that there are episodes, all of one device.

    Raises:
        HandrailError: it is not so.
    """
    if not episodes:
        raise HandrailError("fit: expected one recorded episode or more, got none that can be used")
    kinds = {(each.device, each.keys) for each in episodes}
    if len(kinds) > 1:
        words = sorted(f"{device or 'a script'} ({'keys' if keys else 'sticks'})" for device, keys in kinds)
        raise HandrailError(f"fit: expected one device, got {', '.join(words)}; choose one with --device")


def _unfit(row: dict[str, Any], frames: dict[str, np.ndarray], fps: int) -> str:
    """Return why nothing can be learned from an episode; "" if something can."""
    if not is_count(row.get("seed")):
        return "it has no seed, so what the operator saw is not known"
    if row.get(TRIMMED):
        return "its beginning was cut off, so when the operator saw what is not known"
    modes = sorted(set(frames["teleop.mode"].tolist()))
    if len(modes) > 1:
        return f"the mode was changed ({', '.join(modes)})"
    if not all(np.isfinite(frames[name]).all() for name in ("action", "teleop.values", "teleop.raw")):
        return "its input or action is not finite"
    if not frames["teleop.raw"].any():
        return "no input was ever moved"
    if len(frames["action"]) - _began(frames["teleop.raw"]) < _SHORTEST * fps:
        return f"the operator steered for less than {_SHORTEST:g} s"
    return ""


def _steered(name: str, row: dict[str, Any], frames: dict[str, np.ndarray], fps: int, device: str) -> Steered:
    config = replace(recorded_settings(row), cameras="", time_limit=(len(frames["action"]) - 0.5) / fps)
    config = _in_mode(config, str(frames["teleop.mode"][0]))
    env = build_env(config, fps)
    try:
        _check_shapes(name, frames, env)
        mode = build_mode(config, env.model)
        if mode.device != STICKS:
            raise HandrailError(
                f"{name}: expected a mode with velocity sticks on all its channels, got {config.mode!r},"
                f" whose device is {mode.device!r}: what it reads is no deflection"
            )
        began = _began(frames["teleop.raw"])
        views = _views(env, frames["action"], row["seed"], fps)[began:]
        model = env.model
    finally:
        env.close()
    raw, values = frames["teleop.raw"][began:], frames["teleop.values"][began:, :-1]
    gains, full = _levels(model, mode, raw, values)
    script = script_of(model, mode, TASKS.find(config.task), gains)
    script.reset(views[0])
    return Steered(
        name=name,
        participant=str(row.get("participant") or ""),
        device=device,
        keys=bool(np.isin(np.abs(raw), (0.0, 1.0)).all()),
        fps=fps,
        model=model,
        mode=mode,
        gains=gains,
        views=tuple(views),
        goals=tuple(script.motion_goal(view) for view in views),
        inputs=values / full,
        owned=frames["teleop.mask"][began:, :-1].astype(bool),
    )


def _check_shapes(name: str, frames: dict[str, np.ndarray], env: HandrailEnv) -> None:
    """Check that the columns are of the robot that the episode names."""
    channels = Channels.of(env.model.description).size
    sizes = {"action": env.model.size + 1, "teleop.raw": channels}
    sizes |= dict.fromkeys(("teleop.values", "teleop.mask"), channels + 1)
    for column, size in sizes.items():
        if frames[column].shape[1:] != (size,):
            raise HandrailError(
                f"{name}: expected {size} numbers as {column}, got {frames[column].shape[1:]}"
            )


def _in_mode(config: SessionConfig, mode: str) -> SessionConfig:
    """Return the settings with the mode that the frames name.

    Raises:
        HandrailError: there is no such mode, or a dataset alone would have a module imported.
    """
    if mode.startswith(MASK):
        return replace(config, mask=mode.removeprefix(MASK))
    MODES.admit(mode, ())
    return replace(config, mode=mode, mask="")


def _began(raw: FloatArray) -> int:
    """Return the frame at which an input was first moved."""
    return int(np.flatnonzero(raw.any(axis=1))[0])


def _levels(
    model: RobotModel, mode: TeleopMode, raw: FloatArray, values: FloatArray
) -> tuple[Gains, FloatArray]:
    """Return the operator's gains and full stick, (m,), at the speed level that the values tell."""
    usual = gains_of(model, mode, HumanSettings())
    full = StickMap(model, mode, usual).full
    asked = np.linalg.norm(full * raw, axis=1)
    moving = (asked > 0) & values.any(axis=1)
    level = float(np.median(np.linalg.norm(values[moving], axis=1) / asked[moving])) if moving.any() else 1.0
    names = ("hand_speed", "hand_rate", "base_speed", "base_rate", "joint_rate")
    return replace(usual, **{name: level * getattr(usual, name) for name in names}), level * full


def _views(env: HandrailEnv, actions: FloatArray, seed: int, fps: int) -> list[View]:
    """Return what the operator saw at every frame."""
    watcher, period = _Watcher(), 1.0 / fps
    commands = RecordedCommands(actions, period)
    Session(env, commands, watcher, (), control_period=period, record_period=period).run(seed)
    return watcher.views[:: round(env.fps / fps)][: len(actions)]


class _Watcher:
    """Keeps what it sees and asks for nothing; an operator."""

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin an episode."""
        self.views: list[View] = []

    def act(self, view: View) -> Intent:
        """Return the intent of who touches nothing."""
        self.views.append(view)
        return Intent(np.zeros(0), np.zeros(0, dtype=bool))
