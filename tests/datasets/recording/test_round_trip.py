"""What is recorded is what unmodified LeRobot reads."""

import json
import warnings

import numpy as np
import pandas as pd
import pytest
from canned import canned
from datasets_helpers import (
    CAMERA_FEATURES,
    CAMERAS,
    FPS,
    REPO,
    ROBOT,
    STATE_FEATURES,
    TASKS,
    check_pictures,
    frame_of,
    length_of,
    open_with_lerobot,
    record,
    record_one,
    resume,
)

from handrail.datasets.reading.reader import read_episodes, read_frames

EPISODES = 5


@pytest.fixture(scope="module")
def root():
    return canned(record, EPISODES, cameras=True)


@pytest.fixture(scope="module")
def dataset(root):
    return open_with_lerobot(root)


def _rows():
    return [(episode, index) for episode in range(EPISODES) for index in range(length_of(episode))]


def test_every_row_is_there(dataset):
    rows = _rows()
    assert (len(dataset), dataset.num_episodes, dataset.fps) == (len(rows), EPISODES, FPS)
    for number, (episode, index) in enumerate(rows):
        item, expected = dataset.hf_dataset[number], frame_of(episode, index, cameras=False)
        for key, value in expected.items():
            feature = STATE_FEATURES[key]
            if feature.dtype == "string":
                assert item[key] == value
            else:
                found = item[key].numpy()  # LeRobot hands out scalars as float32, whatever is stored
                assert np.array_equal(found, np.asarray(value, feature.dtype).astype(found.dtype))
        assert int(item["index"]) == number
        assert (int(item["episode_index"]), int(item["frame_index"])) == (episode, index)
        assert abs(float(item["timestamp"]) - index / FPS) < 1e-6
        assert dataset.meta.tasks.iloc[int(item["task_index"])].name == TASKS[episode // 2 % 2]


def test_our_reader_gives_the_stored_types(root):
    for episode in range(EPISODES):
        frames = read_frames(root, episode)
        for index in range(length_of(episode)):
            for key, value in frame_of(episode, index, cameras=False).items():
                feature = STATE_FEATURES[key]
                expected = value if feature.dtype == "string" else np.asarray(value, feature.dtype)
                assert np.array_equal(frames[key][index], expected)
                assert feature.dtype in ("string", frames[key].dtype)


def test_every_picture_is_at_its_row(dataset):
    check_pictures(dataset, range(len(dataset)))


def test_extra_columns_are_in_the_metadata(dataset):
    for episode in range(EPISODES):
        row = dataset.meta.episodes[episode]
        assert row["success"] == (episode % 2 == 0)
        assert (row["failure_reason"], row["seed"]) == ("", episode)
        assert json.loads(row["versions"]) == {"handrail": "0"}
    assert dataset.meta.filter_episodes(lambda row: row["success"]) == [0, 2, 4]


def test_statistics_are_those_of_lerobot(root, dataset):
    from lerobot.datasets.compute_stats import aggregate_stats, compute_episode_stats, get_feature_stats

    features = {key: value for key, value in dataset.meta.features.items() if value["dtype"] != "video"}
    table = pd.concat([pd.read_parquet(path) for path in sorted(root.glob("data/*/*.parquet"))])
    episodes = []
    for _, rows in table.groupby("episode_index"):
        arrays: dict = {key: np.stack(list(rows[key])) for key in features}
        arrays["timestamp"] = arrays["frame_index"] / FPS  # LeRobot's are of the float64 values
        stats = compute_episode_stats(arrays, features)
        for place, key in enumerate(CAMERAS):
            number = int(rows["episode_index"].iloc[0])
            pictures = np.stack(
                [frame_of(number, i, cameras=True)[CAMERAS[place]] for i in range(len(rows))]
            ).transpose(0, 3, 1, 2)
            found = get_feature_stats(pictures.astype(float), axis=(0, 2, 3), keepdims=True)
            stats[key] = {k: v if k == "count" else np.squeeze(v / 255, axis=0) for k, v in found.items()}
        episodes.append(stats)
    expected = aggregate_stats(episodes)
    assert expected.keys() == dataset.meta.stats.keys()
    for key, column in expected.items():
        for name, value in column.items():
            found = dataset.meta.stats[key][name]
            assert found.shape == value.shape
            bin_width = 2e-4 if key in CAMERAS and name.startswith("q") else 0.0  # a level on its edge
            np.testing.assert_allclose(
                found, value, rtol=1e-5, atol=1e-5 + bin_width, err_msg=f"{key} {name}"
            )


def test_info_is_what_lerobot_would_write(tmp_path, dataset):
    from lerobot.datasets.dataset_metadata import LeRobotDatasetMetadata

    features = {
        key: {"dtype": f.dtype, "shape": f.shape, "names": None if f.names is None else list(f.names)}
        for key, f in CAMERA_FEATURES.items()
    }
    theirs = LeRobotDatasetMetadata.create(REPO, FPS, features, ROBOT, tmp_path / "theirs").info.to_dict()
    ours = dataset.meta.info.to_dict()
    for key in CAMERAS:
        assert ours["features"][key].pop("info")["video.codec"] == "h264"
    counts = ("total_episodes", "total_frames", "total_tasks", "splits")
    assert {k: v for k, v in ours.items() if k not in counts} == {
        k: v for k, v in theirs.items() if k not in counts
    }


def test_info_on_the_videos_is_what_lerobot_probes(root, dataset):
    from lerobot.datasets.video_utils import get_video_info

    for key in CAMERAS:
        probed = get_video_info(root / dataset.meta.get_video_file_path(0, key))
        assert probed.items() <= dataset.meta.features[key]["info"].items()


def test_lerobot_can_go_on_with_the_dataset(tmp_path):
    root = record(tmp_path / "set", 2)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from lerobot.datasets.lerobot_dataset import LeRobotDataset

        theirs = LeRobotDataset.resume(REPO, root=root)
        for index in range(4):
            frame = frame_of(2, index, cameras=False)
            arrays = {
                key: np.atleast_1d(np.asarray(value, STATE_FEATURES[key].dtype))
                for key, value in frame.items()
                if STATE_FEATURES[key].dtype != "string"
            }
            theirs.add_frame({**frame, **arrays, "task": TASKS[0]})
        theirs.save_episode()
        theirs.finalize()
    again = open_with_lerobot(root)
    assert (again.num_episodes, len(again)) == (3, length_of(0) + length_of(1) + 4)
    assert [row["episode_index"] for row in read_episodes(root)] == [0, 1, 2]


def test_resuming_goes_on_where_it_stopped(tmp_path):
    whole, parts = record(tmp_path / "whole", 3, cameras=True), record(tmp_path / "parts", 1, cameras=True)
    for _ in range(2):
        with resume(parts, cameras=True) as writer:
            record_one(writer, cameras=True)
    for path in sorted(whole.rglob("*.*")):
        if path.is_file():
            assert path.read_bytes() == (parts / path.relative_to(whole)).read_bytes(), path
