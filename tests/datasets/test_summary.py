"""Any LeRobot dataset can be summed up; what it does not hold is shown as a dash."""

import numpy as np
import pytest
from datasets_helpers import FPS, REPO, ROBOT, record_with_lerobot
from editing_helpers import record_episodes

from handrail.datasets.format.manifest import Manifest
from handrail.datasets.format.schema import Feature
from handrail.datasets.quality.metrics import high_frequency_content, rate_of_change, sparc
from handrail.datasets.quality.summary import CHATTERING, summarize
from handrail.datasets.reading.reader import read_episodes, read_frames, read_info
from handrail.datasets.recording.writer import EpisodeWriter

FEATURES = {
    "observation.state": Feature("float32", (4,), ("x", "tool.x", "tool.y", "tool.z")),
    "action": Feature("float32", (2,), ("v_x", "gripper")),
    "teleop.mode": Feature("string"),
    "controller.smallest_distance": Feature("float32"),
    "safety.contacts": Feature("int64"),
}
STEPS = 2 * FPS


def _frame(index: int) -> dict:
    phase = index / STEPS
    reach = 10 * phase**3 - 15 * phase**4 + 6 * phase**5
    return {
        "observation.state": np.array([index, reach, 0.0, 1.0]),
        "action": np.array([np.sin(phase), 5.0 * (index % 2)]),
        "teleop.mode": "base" if index < 10 else "arm",
        "controller.smallest_distance": 0.2 if index != 7 else 0.03,
        "safety.contacts": int(index in (5, 6, 20)),
    }


@pytest.fixture
def root(tmp_path):
    with EpisodeWriter.create(tmp_path / "set", Manifest(REPO, FPS, ROBOT, FEATURES)) as writer:
        for success in (True, False):
            for index in range(STEPS):
                writer.add_frame(_frame(index), "lift the cup")
            writer.save_episode({"success": success, "failure_reason": "" if success else "dropped it"})
    return tmp_path / "set"


def test_an_episode_of_ours(root):
    first, second = summarize(root)
    assert (first.task, first.mode, first.length) == ("lift the cup", "base → arm", STEPS / FPS)
    assert (first.success, first.failure_reason) == (True, None)
    assert (second.success, second.failure_reason) == (False, "dropped it")
    assert first.smallest_distance == pytest.approx(0.03)
    assert first.contacts == 2
    assert first.smoothness == pytest.approx(-1.41, abs=0.03)
    assert (second.cells()["success"], second.cells()["why not"]) == ("no", "dropped it")


def test_contacts_that_began_between_two_frames_count(tmp_path):
    """Law: the number that the row says is shown; a robot may run at a higher rate than the recording."""
    features = {"safety.contacts": FEATURES["safety.contacts"]}
    with EpisodeWriter.create(tmp_path / "set", Manifest(REPO, FPS, ROBOT, features)) as writer:
        for row in ({"contact_onsets": 3}, {"contact_onsets": None}):
            for touching in (0, 1, 1):
                writer.add_frame({"safety.contacts": touching}, "lift the cup")
            writer.save_episode(row)
    assert [each.contacts for each in summarize(tmp_path / "set")] == [3, 1]


def test_chattering_of_what_was_commanded(tmp_path):
    """Corrections count on joints that are owned, whatever else was asked; the gripper is no velocity."""
    asked = ("base.vx", "joint.x", "joint.elbow", "gripper")
    features = {
        "action": Feature("float32", (3,), ("v_x", "v_elbow", "gripper")),
        "teleop.values": Feature("float32", (4,), asked),
        "teleop.mask": Feature("bool", (4,), asked),
    }
    sent = np.array([[0.1, 0.2], [0.1, 0.5], [0.1, 0.2], [0.9, 0.2], [0.1, 0.2]])
    with EpisodeWriter.create(tmp_path / "set", Manifest(REPO, FPS, ROBOT, features)) as writer:
        for owned in ([False, False, True], [True, False, False]):
            for index, row in enumerate(sent):
                values = np.array([0.7, 0.1, 0.2, index % 2])
                mask = np.array([*owned, True])
                action = np.append(row, index % 2)
                frame = {"action": action, "teleop.values": np.where(mask, values, 0.0), "teleop.mask": mask}
                writer.add_frame(frame, "drive")
            writer.save_episode()
    elbow, base = summarize(tmp_path / "set")
    assert elbow.corrections == 2
    assert base.corrections is None
    assert elbow.rate_of_change == pytest.approx(rate_of_change(sent, FPS), rel=1e-5)
    assert elbow.high_frequency_content == pytest.approx(high_frequency_content(sent, FPS), rel=1e-5)
    assert base.cells()[CHATTERING[-1]] == "–"


def test_without_a_tool_the_configuration_is_judged(tmp_path):
    root = record_episodes(tmp_path / "set", 2)
    turned = read_frames(root, 1)["observation.state"][:, 0].astype(float)
    expected = sparc(np.abs(np.diff(turned)) * FPS, FPS)
    assert np.isfinite(expected)
    assert summarize(root)[1].smoothness == pytest.approx(expected)


def test_a_dataset_of_lerobot_s_own(tmp_path):
    features = {
        "observation.state": {"dtype": "float32", "shape": (2,), "names": {"motors": ["a", "b"]}},
        "action": {"dtype": "float32", "shape": (1,), "names": None},
        "matrix": {"dtype": "float32", "shape": (2, 3), "names": None},
        "flags": {"dtype": "bool", "shape": (3,), "names": None},
    }

    def frame(episode, index):
        state, action = np.array([episode, index], np.float32), np.array([index], np.float32)
        other = {"matrix": np.full((2, 3), index, np.float32), "flags": np.arange(3) == index % 3}
        return {"observation.state": state, "action": action, "task": "push", **other}

    episodes = [[frame(episode, index) for index in range(4 + episode)] for episode in range(3)]
    record_with_lerobot(tmp_path / "set", features, episodes)
    info = read_info(tmp_path / "set")
    assert (info.episodes, info.frames, info.from_handrail) == (3, 15, False)
    assert info.features["observation.state"].names == ("a", "b")
    assert [row["length"] for row in read_episodes(tmp_path / "set")] == [4, 5, 6]
    frames = read_frames(tmp_path / "set", 1)
    assert frames["observation.state"].tolist() == [[1.0, index] for index in range(5)]
    assert frames["matrix"].shape == (5, 2, 3)
    assert frames["flags"].sum() == 5
    assert frames["action"].shape == (5,)
    cells = summarize(tmp_path / "set")[2].cells()
    known = {name: cell for name, cell in cells.items() if cell != "–"}
    assert known == {"episode": "2", "task": "push", "length [s]": "0.2", "smoothness": "-1.69"}
