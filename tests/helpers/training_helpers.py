"""What the tests of imitation training share: a small dataset such as Handrail records, a tiny policy."""

import dataclasses
import shutil
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from handrail.collect.config import SessionConfig, StoredConfig
from handrail.collect.session.recorded import settings_json
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.robot.description import load_description
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.schema import Feature
from handrail.datasets.recording.frames import frame_features
from handrail.datasets.recording.writer import EpisodeWriter
from handrail.policies.imitation.config import TrainConfig

FPS = 20
CHANNELS = Channels.of(load_description("ridgeback_ur10"))
JOINTS = tuple(name.removeprefix("joint.") for name in CHANNELS.joints)
POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")
STATE = (
    *(f"{joint}.{kind}" for kind in ("pos", "vel") for joint in JOINTS),
    *(f"tool.{part}" for part in POSE),
)
ENVIRONMENT = tuple(f"goal.{part}" for part in POSE)
TINY = ("chunk_size=4", "n_action_steps=2", "dim_model=16", "n_heads=2")
TINY += ("dim_feedforward=16", "n_encoder_layers=1")
_COLUMNS = ("observation.state", "observation.environment_state", "action", "teleop.values", "teleop.mask")


def features(cameras: Sequence[str] = ()) -> dict[str, Feature]:
    every = frame_features(STATE, ENVIRONMENT, JOINTS, CHANNELS.names)
    pictures = {f"observation.images.{name}": Feature("video", (16, 16, 3)) for name in cameras}
    return {key: every[key] for key in _COLUMNS} | pictures


def frame(rng: np.random.Generator, cameras: Sequence[str] = ()) -> dict:
    pose = np.append(rng.normal(size=3), (turn := rng.normal(size=4)) / np.linalg.norm(turn))
    mask = np.append(CHANNELS.mask("ee"), True)
    values = np.where(mask, rng.normal(size=mask.shape), 0.0)
    pictures = {f"observation.images.{name}": rng.integers(0, 255, (16, 16, 3), np.uint8) for name in cameras}
    return {
        "observation.state": np.append(rng.normal(size=len(STATE) - 7), pose),
        "observation.environment_state": pose,
        "action": rng.normal(size=len(JOINTS) + 1),
        "teleop.values": values,
        "teleop.mask": mask,
    } | pictures


def write_dataset(
    root: Path,
    lengths: Sequence[int] = (9, 7, 8),
    modes: Sequence[str] = (),
    successes: Sequence[bool] = (),
    cameras: Sequence[str] = (),
    limits: Sequence[float] = (),
    driven: Sequence[str] = (),
) -> Path:
    """Write episodes of random numbers; modes, successes and time limits as given, else `ee` and success.

    `driven`: the mode that a last frame of each episode names.
    """
    rng = np.random.default_rng(0)
    named = {"teleop.mode": Feature("string", (1,))} if driven else {}
    with EpisodeWriter.create(
        root, Manifest("handrail/test", FPS, "ridgeback_ur10", features(cameras) | named)
    ) as writer:
        for number, length in enumerate(lengths):
            for index in range(length):
                said = {"teleop.mode": driven[number] if index == length - 1 else ""} if driven else {}
                writer.add_frame(frame(rng, cameras) | said, "reach")
            mode = modes[number] if modes else "ee"
            success = successes[number] if successes else True
            row = {"environment": "reach", "mode": mode, "success": success, "seed": number}
            if limits:
                row["settings"] = settings_json(SessionConfig(task="reach", time_limit=limits[number]))
            writer.save_episode(row)
    return root


def tiny(root: Path, output: Path, *options: str, **settings) -> TrainConfig:
    """Return the settings of a training of a moment."""
    source = {"dataset": StoredConfig("handrail/test", str(root)), "output": str(output)}
    size = {"steps": 6, "batch_size": 8, "save_freq": 3, "policy_options": (*TINY, *options)}
    return TrainConfig(**(source | size | settings))


def refused(config: TrainConfig, words: str) -> None:
    """The law: what cannot be trained is one line."""
    from handrail.policies.imitation.training.training import train

    with pytest.raises(HandrailError, match=words):
        train(config)


def cut(config: TrainConfig, folder: Path) -> TrainConfig:
    """Copy a training without its last checkpoint; return the settings that go on with it."""
    shutil.copytree(config.folder, folder, symlinks=True)
    shutil.rmtree(folder / "checkpoints" / "000006")
    return dataclasses.replace(config, output=str(folder), resume=True)


def weights(folder):
    """Return the weights of a policy, as they lie on the disk."""
    return (folder / "model.safetensors").read_bytes()
