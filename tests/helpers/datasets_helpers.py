"""What the dataset tests share: a small schema, frames whose content is known, LeRobot as the judge."""

import hashlib
import os
import warnings
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from handrail.controllers.errors import HandrailError
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.schema import Feature
from handrail.datasets.reading.reader import read_episodes, read_frames
from handrail.datasets.recording.writer import EpisodeWriter

FPS = 30
REPO = "handrail/test"
ROBOT = "testbot"
TASKS = ("lift the cup", "put it down")
CAMERAS = ("observation.images.wrist", "observation.images.scene")

STATE_FEATURES = {
    "observation.state": Feature("float32", (3,), ("x", "y", "v_x")),
    "action": Feature("float32", (2,), ("v_x", "gripper")),
    "teleop.mask": Feature("bool", (4,)),
    "teleop.mode": Feature("string"),
    "controller.solve_time": Feature("float32"),
    "safety.contacts": Feature("int64"),
    "engaged": Feature("bool"),
    "wall_clock": Feature("float64"),
}
TINY_FEATURES = {key: STATE_FEATURES[key] for key in ("action", "teleop.mode")}  # for many quick episodes
CAMERA_FEATURES = STATE_FEATURES | {key: Feature("video", (32, 48, 3)) for key in CAMERAS}


def brightness(episode: int, index: int, camera: int) -> int:
    """Return the level that all pixels of a picture have; it tells which picture it is."""
    return (episode * 17 + index * 7 + camera * 101) % 200 + 20


def frame_of(episode: int, index: int, cameras: bool) -> dict:
    number = episode * 1000 + index
    frame = {
        "observation.state": np.array([number, np.sin(number), index / 3], np.float32),
        "action": np.array([np.cos(number), index % 2], np.float32),
        "teleop.mask": np.arange(4) == index % 4,
        "teleop.mode": ("base", "arm")[index // 3 % 2],
        "controller.solve_time": 1e-3 * (index + 1),
        "safety.contacts": index % 3,
        "engaged": index % 2 == 0,
        "wall_clock": 1.7e9 + number / 7,
    }
    if cameras:
        for place, key in enumerate(CAMERAS):
            frame[key] = np.full((32, 48, 3), brightness(episode, index, place), np.uint8)
    return frame


def length_of(episode: int) -> int:
    return 8 + 3 * (episode % 3)


def record_one(writer: EpisodeWriter, cameras: bool, first: int = 0) -> int:
    """Record and save the next episode, as if `first` others lay before all of the dataset."""
    episode = first + writer.num_episodes
    for index in range(length_of(episode)):
        frame = frame_of(episode, index, cameras)
        writer.add_frame({key: frame[key] for key in writer.features}, TASKS[episode // 2 % 2])
    return writer.save_episode({"success": episode % 2 == 0, "failure_reason": None, "seed": episode})


def _manifest(features) -> Manifest:
    return Manifest(REPO, FPS, ROBOT, features, {"handrail": "0"})


def create(root: Path, cameras: bool = False, features=None, **options) -> EpisodeWriter:
    features = features or (CAMERA_FEATURES if cameras else STATE_FEATURES)
    return EpisodeWriter.create(root, _manifest(features), **options)


def resume(root: Path, cameras: bool = False, features=None) -> EpisodeWriter:
    features = features or (CAMERA_FEATURES if cameras else STATE_FEATURES)
    return EpisodeWriter.resume(root, _manifest(features))


def record(root: Path, episodes: int, cameras: bool = False, features=None) -> Path:
    with create(root, cameras, features) as writer:
        for _ in range(episodes):
            record_one(writer, cameras)
    return root


def files_of(root: Path, episode: int, cameras: bool) -> list[Path]:
    layout = Layout(root)
    videos = [layout.video(key, episode) for key in CAMERAS] if cameras else []
    return [layout.data(episode), layout.row(episode), *videos]


def digest(root: Path, episode: int, cameras: bool) -> str:
    """Return one hash over all files of an episode."""
    content = b"".join(path.read_bytes() for path in files_of(root, episode, cameras))
    return hashlib.sha256(content).hexdigest()


def tree(root: Path) -> dict[str, bytes]:
    """Return the content of every file in a folder."""
    return {
        path.relative_to(root).as_posix(): path.read_bytes() for path in root.rglob("*") if path.is_file()
    }


def open_with_lerobot(root: Path, **options) -> Any:
    """Open a dataset with unmodified LeRobot; its own warnings are not ours to judge."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from lerobot.datasets.lerobot_dataset import LeRobotDataset

        return LeRobotDataset(REPO, root=root, video_backend="pyav", **options)


def record_with_lerobot(
    root: Path, features: dict, episodes: Iterable, fps: int = FPS, robot: str = ""
) -> Path:
    """Record episodes, each some frames, with unmodified LeRobot."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from lerobot.datasets.lerobot_dataset import LeRobotDataset

        dataset = LeRobotDataset.create(REPO, fps, features, root=root, robot_type=robot or ROBOT)
        for episode in episodes:
            for frame in episode:
                dataset.add_frame(frame)
            dataset.save_episode()
        dataset.finalize()
    return root


def check_pictures(dataset, rows) -> None:
    """Check that the pictures that LeRobot shows for some rows are those recorded with them."""
    for row in rows:
        item = dataset[int(row)]
        for place, key in enumerate(CAMERAS):
            expected = brightness(int(item["episode_index"]), int(item["frame_index"]), place)
            assert abs(float(item[key].mean()) * 255 - expected) < 2.5


def fails(action, *words: str, unchanged: Path | None = None) -> None:
    """Check that an action is refused with some words, and leaves a folder as it was."""
    before = tree(unchanged) if unchanged else None
    with pytest.raises(HandrailError) as caught:
        action()
    for word in words:
        assert word in str(caught.value)
    assert before is None or tree(unchanged) == before


def check_is(root: Path, originals: Iterable[int]) -> None:
    """Check that the episodes are, in order, those that were recorded under these numbers."""
    rows, start = read_episodes(root), 0
    assert [row["seed"] for row in rows] == list(originals)
    for place, number in enumerate(originals):
        row, frames = rows[place], read_frames(root, place)
        assert (row["episode_index"], row["dataset_from_index"]) == (place, start)
        assert row["length"] == length_of(number)
        expected = [frame_of(number, i, cameras=False)["action"] for i in range(length_of(number))]
        assert np.array_equal(frames["action"], np.array(expected))
        assert frames["index"].tolist() == list(range(start, start + length_of(number)))
        assert set(frames["episode_index"]) == {place}
        start += length_of(number)


def keep_files(monkeypatch: pytest.MonkeyPatch) -> None:
    """Refuse to remove the files of episodes where a whole folder is removed."""
    real = os.unlink

    def unlink(path, **options):
        if str(path).startswith("file-") and "dir_fd" in options:
            raise PermissionError(13, "Permission denied")
        real(path, **options)

    monkeypatch.setattr(os, "unlink", unlink)
