"""Errors are one line that says what is wrong, and change nothing."""

import json
import os
import subprocess
import sys
import threading
from typing import Any

import numpy as np
import pytest
from datasets_helpers import (
    CAMERAS,
    FPS,
    REPO,
    ROBOT,
    STATE_FEATURES,
    create,
    fails,
    frame_of,
    open_with_lerobot,
    record,
    record_one,
    resume,
    tree,
)
from places import HELPERS

from handrail.datasets.format import video
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.schema import Feature, check_features, check_frame
from handrail.datasets.reading.reader import read_episodes, read_frames, read_info
from handrail.datasets.recording.writer import EpisodeWriter


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"fps": 0}, ("fps", "0")),
        ({"fps": 30.0}, ("fps", "30.0")),
        ({"repo_id": ""}, ("repo_id",)),
        ({"repo_id": "a/b/c"}, ("repo_id", "a/b/c")),
        ({"robot_type": ""}, ("robot_type",)),
        ({"features": {}}, ("features",)),
        ({"features": {"a/b": Feature("float32")}}, ("a/b", "'/'")),
        ({"features": {"index": Feature("int64")}}, ("index", "LeRobot")),
        ({"features": {"x": Feature("float16")}}, ("float16", "float32", "string")),
        ({"features": {"x": Feature("float32", (2, 2))}}, ("x", "(2, 2)")),
        ({"features": {"x": Feature("string", (2,))}}, ("x", "(1,)")),
        ({"features": {"x": Feature("float32", (2,), ("a",))}}, ("2 names", "got 1")),
        ({"features": {"c": Feature("video", (31, 48, 3))}}, ("c", "even", "(31, 48, 3)")),
        ({"features": {"c": Feature("video", (3, 48, 48))}}, ("c", "(height, width, 3)")),
    ],
)
def test_nothing_is_created_for_a_wrong_argument(tmp_path, change, words):
    arguments = {"repo_id": REPO, "fps": FPS, "features": STATE_FEATURES, "robot_type": ROBOT} | change
    fails(lambda: EpisodeWriter.create(tmp_path / "set", Manifest(**arguments)), *words)
    assert not list(tmp_path.iterdir())


def test_a_folder_that_cannot_be_written(tmp_path):
    fails(lambda: create(tmp_path.__class__("/proc/handrail/set")), "/proc/handrail/set")
    if os.geteuid() == 0:
        return  # root may write anywhere else
    tmp_path.chmod(0o555)
    fails(lambda: create(tmp_path / "set"), "can be written", str(tmp_path))
    assert not list(tmp_path.iterdir())


def test_two_recorders_never_share_a_dataset(tmp_path):
    root = tmp_path / "set"
    with create(root) as writer:
        record_one(writer, cameras=False)
        for attempt in (lambda: resume(root), lambda: create(root, overwrite=True)):
            fails(attempt, "another recorder")
        code = f"from datasets_helpers import *; resume(Path({str(root)!r}))"
        child = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=HELPERS)
        assert "another recorder" in child.stderr
        record_one(writer, cameras=False)
    with resume(root) as writer:
        assert writer.num_episodes == 2


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"fps": 50}, ("fps", "is 30", "got 50")),
        ({"robot_type": "other"}, ("robot_type", "testbot", "other")),
        ({"features": STATE_FEATURES | {"more": Feature("bool")}}, ("'more'", "none", "bool")),
        ({"features": {"action": STATE_FEATURES["action"]}}, ("'observation.state'", "got none")),
        ({"features": STATE_FEATURES | {"action": Feature("float32", (3,))}}, ("'action'", "(2,)", "(3,)")),
    ],
)
def test_resume_refuses_another_schema(tmp_path, change, words):
    root = record(tmp_path / "set", 1)
    Layout(root).info.write_bytes(b"{torn")  # refused before anything is repaired
    arguments = {"repo_id": REPO, "fps": FPS, "features": STATE_FEATURES, "robot_type": ROBOT} | change
    words = ("--resume: cannot add to", *words)
    fails(lambda: EpisodeWriter.resume(root, Manifest(**arguments)), *words, unchanged=root)


def test_resume_refuses_what_handrail_did_not_write(tmp_path):
    fails(lambda: resume(tmp_path / "none"), "no folder")
    fails(lambda: resume(tmp_path), "a LeRobot dataset", "a folder without one")
    (tmp_path / "meta").mkdir()
    (tmp_path / "meta" / "info.json").write_text(json.dumps({"codebase_version": "v3.0"}))
    fails(lambda: resume(tmp_path), "not written by Handrail", "another folder")
    (tmp_path / "meta" / "handrail.json").write_text("{torn")
    fails(lambda: resume(tmp_path), "handrail.json", "manifest")
    assert sorted(tree(tmp_path)) == ["meta/handrail.json", "meta/info.json"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"action": None}, ("missing: action",)),
        ({"surprise": 1}, ("unknown: surprise",)),
        ({"action": np.zeros(3, np.float32)}, ("'action'", "(2,)", "(3,)")),
        ({"action": np.zeros((1, 2))}, ("'action'", "(1, 2)")),
        ({"safety.contacts": 1.5}, ("'safety.contacts'", "int64", "float64")),
        ({"engaged": 1}, ("'engaged'", "bool", "int64")),
        ({"teleop.mode": 3}, ("'teleop.mode'", "str", "int")),
        ({"controller.solve_time": "fast"}, ("'controller.solve_time'", "float32")),
        ({"action": np.array([0.0, np.nan])}, ("'action'", "finite", "gripper")),
        ({"observation.state": np.array([1.0, np.inf, 0.0])}, ("'observation.state'", "inf", "at y")),
        ({"observation.state": np.array([1.0, 1e300, 0.0])}, ("'observation.state'", "inf", "at y")),
    ],
)
def test_frames_that_do_not_fit(tmp_path, change, words):
    with create(tmp_path / "set") as writer:
        frame = {k: v for k, v in (frame_of(0, 0, cameras=False) | change).items() if v is not None}
        fails(lambda: writer.add_frame(frame, "task"), *words)
        assert writer.open_frames == 0
        writer.add_frame(frame_of(0, 0, cameras=False) | {"controller.solve_time": np.nan}, "task")
        writer.save_episode()


@pytest.mark.parametrize(
    ("change", "task", "said"),
    [
        ({"teleop.mode": "\udcff"}, "task", {"seed": 1}),
        ({}, "\udcff", {"seed": 1}),
        ({}, "task", {"seed": 1, "failure_reason": "\udcff"}),
        ({}, "task", {"seed": 2**64}),
    ],
)
def test_a_value_that_no_file_takes_costs_one_episode(tmp_path, change, task, said):
    with create(tmp_path / "set") as writer:
        record_one(writer, cameras=False)
        writer.add_frame(frame_of(1, 0, cameras=False) | change, task)
        fails(
            lambda: writer.save_episode(said), "episode 1", "could not be saved", "the 1 saved episodes are"
        )
        assert record_one(writer, cameras=False) == 1
    assert len(read_episodes(tmp_path / "set")) == 2


def test_whole_numbers_must_fit_and_pictures_must_be_bytes():
    features = {"n": Feature("int8"), "camera": Feature("video", (32, 32, 3))}
    picture = np.zeros((32, 32, 3), np.uint8)
    check_features(features)
    assert check_frame({"n": np.int64(-3), "camera": picture}, features)["n"].dtype == np.int8
    fails(lambda: check_frame({"n": 300, "camera": picture}, features), "'n'", "int8", "300")
    fails(lambda: check_frame({"n": 3, "camera": picture.astype(float)}, features), "'camera'", "uint8")
    fails(lambda: check_frame({"n": 3, "camera": picture.transpose(2, 0, 1)}, features), "(32, 32, 3)")


def test_a_frame_is_copied(tmp_path, monkeypatch):
    """Also pictures that wait for their encoder."""
    root, may, levels = tmp_path / "set", threading.Event(), video.image_levels
    monkeypatch.setattr(video, "image_levels", lambda image: (may.wait(10.0), levels(image))[1])
    with create(root, cameras=True) as writer:
        frame = frame_of(0, 0, cameras=True)
        for _ in range(3):
            writer.add_frame(frame, "task")
        frame["action"][:] = 99
        frame[CAMERAS[0]][:] = 0
        may.set()
        writer.save_episode()
    shown = open_with_lerobot(root)[2][CAMERAS[0]].mean().item() * 255
    assert shown == pytest.approx(frame_of(0, 0, cameras=True)[CAMERAS[0]].mean(), abs=2.5)
    assert np.array_equal(read_frames(root, 0)["action"][0], frame_of(0, 0, cameras=False)["action"])


def test_episode_columns_keep_their_names_and_types(tmp_path):
    root = tmp_path / "set"
    frame = frame_of(0, 0, cameras=False)
    with create(root) as writer:
        writer.add_frame(frame, "task")
        for name in ("tasks", "a/b", "length"):
            fails(lambda name=name: writer.save_episode({name: 1}), name)
        wrong: dict[str, Any] = {"success": [True]}
        fails(lambda: writer.save_episode(wrong), "success", "list")
        right: dict[str, Any] = {"success": np.True_, "score": 1.5, "why": None}
        assert writer.save_episode(right) == 0
        writer.add_frame(frame, "task")
        fails(lambda: writer.save_episode({"weather": "fine"}), "weather", "success")
        fails(lambda: writer.save_episode({"success": "yes"}), "success", "bool", "'yes'")
        assert writer.open_frames == 1
        assert writer.save_episode({"score": 2}) == 1
    rows = read_episodes(root)
    assert [row["success"] for row in rows] == [True, None]
    assert [row["score"] for row in rows] == [1.5, 2.0]
    assert [row["why"] for row in rows] == ["", ""]


def test_the_writer_says_when_it_cannot(tmp_path):
    writer = create(tmp_path / "set")
    fails(writer.save_episode, "at least one frame")
    fails(lambda: writer.add_frame(frame_of(0, 0, cameras=False), ""), "task")
    writer.close()
    writer.close()
    fails(lambda: writer.add_frame(frame_of(0, 0, cameras=False), "task"), "is closed")
    fails(writer.save_episode, "is closed")


def test_an_interrupt_while_saving_leaves_a_writer_that_refuses(tmp_path, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    with create(tmp_path / "set") as writer:
        record_one(writer, cameras=False)
        writer.add_frame(frame_of(1, 0, cameras=False), "task")
        monkeypatch.setattr("handrail.datasets.recording.writer.move", interrupt)
        with pytest.raises(KeyboardInterrupt):
            writer.save_episode()
        monkeypatch.undo()
        fails(lambda: writer.add_frame(frame_of(1, 0, cameras=False), "task"), "interrupted", "resume")
    with resume(tmp_path / "set") as writer:
        assert record_one(writer, cameras=False) == 1


def test_reading_what_is_not_there(tmp_path):
    root = record(tmp_path / "set", 2)
    fails(lambda: read_info(tmp_path / "none"), "found none")
    fails(lambda: read_info(tmp_path), "not a LeRobot dataset")
    fails(lambda: read_frames(root, 2), "episode 2", "0 to 1")
    fails(lambda: read_frames(root, 0, ["speed"]), "speed", "action")
    Layout(root).data(1).write_bytes(b"no parquet")
    fails(lambda: read_frames(root, 1), "file-001.parquet", "handrail-edit repair")
    Layout(root).row(1).unlink()
    fails(lambda: read_episodes(root), "expected 2", "repair")
    Layout(root).info.write_text('{"codebase_version": "v2.1"}')
    fails(lambda: read_info(root), "v3.0", "v2.1")
    Layout(root).info.write_text("{")
    fails(lambda: read_info(root), "info.json", "repair")
