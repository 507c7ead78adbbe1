"""Datasets for tests of editing: episodes that stand still at both ends; pictures tell which they are."""

from pathlib import Path

import numpy as np
from datasets_helpers import CAMERAS, FPS, REPO, ROBOT, TASKS, brightness, create, record_one

from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.schema import Feature
from handrail.datasets.reading.reader import read_episodes, read_frames
from handrail.datasets.recording.writer import EpisodeWriter

STILL, MOVING = 20, 15  # frames at each end, and between
LENGTH = 2 * STILL + MOVING
FEATURES = {
    "observation.state": Feature("float32", (2,), ("elbow.pos", "elbow.vel")),
    "action": Feature("float32", (1,), ("v_elbow",)),
    "teleop.mode": Feature("string"),
    "teleop.device": Feature("string"),
    "next.success": Feature("bool"),
    "next.done": Feature("bool"),
}
PICTURED = FEATURES | {key: Feature("video", (32, 48, 3)) for key in CAMERAS}


def still_at_both_ends(episode: int, index: int, succeeded: bool, driven: bool = False) -> dict:
    """Return a frame: the elbow turns by 1 rad in the middle of the episode; success comes when it stops."""
    share = np.clip((index - STILL) / MOVING, 0.0, 1.0)
    pictures = {
        key: np.full((32, 48, 3), brightness(episode, index, place), np.uint8)
        for place, key in enumerate(CAMERAS)
    }
    return pictures | {
        "observation.state": np.array([share + episode, 0.0], np.float32),
        "action": np.array([index], np.float32),
        "teleop.mode": "ee",
        "teleop.device": "gamepad" if driven else "",
        "next.success": succeeded and index >= STILL + MOVING,
        "next.done": index == LENGTH - 1,
    }


def record_episodes(
    root: Path, count: int = 4, cameras: bool = False, driven: bool = False, **columns
) -> Path:
    """Record episodes of which every second one fails; each has a task of two by turns."""
    features = PICTURED if cameras else FEATURES
    with EpisodeWriter.create(root, Manifest(REPO, FPS, ROBOT, features)) as writer:
        for episode in range(count):
            succeeded = episode % 2 == 0
            for index in range(LENGTH):
                frame = still_at_both_ends(episode, index, succeeded, driven)
                writer.add_frame({key: frame[key] for key in features}, TASKS[episode // 2 % 2])
            reason = "" if succeeded else "timeout"
            said = {"success": succeeded, "failure_reason": reason, "seed": episode, "operator": "ada"}
            writer.save_episode(said | columns)
    return root


def part(root, first: int, end: int, cameras: bool = False):
    """Record some of the episodes that `record` makes."""
    with create(root, cameras) as writer:
        for _ in range(first, end):
            record_one(writer, cameras, first)
    return root


def content(root) -> list[tuple[dict, dict]]:
    """Return line and rows of every episode; where they lie does not count."""
    return [
        (
            {
                name: value
                for name, value in row.items()
                if "chunk_index" not in name and "file_index" not in name
            },
            {name: values.tolist() for name, values in read_frames(root, row["episode_index"]).items()},
        )
        for row in read_episodes(root)
    ]
