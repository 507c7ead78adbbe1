"""LeRobot's own commands, unmodified: record, replay and teleoperate with our robot and our script."""

import sys

import numpy as np
import pytest
from lerobot.scripts import lerobot_record, lerobot_replay, lerobot_teleoperate

from handrail.collect.lerobot import HandrailSim
from handrail.datasets.reading.reader import read_episodes, read_frames, read_info

pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("default"),  # LeRobot's own
]
FOUND = "--robot.discover_packages_path=handrail.collect.lerobot"
ROBOT = (FOUND, "--robot.type=handrail_sim", "--robot.seed=4")


@pytest.fixture
def run(monkeypatch, tmp_path):
    """Run a command of LeRobot's with its command line, in this process."""

    def main(module, *words):
        folder = f"--robot.calibration_dir={tmp_path}"
        monkeypatch.setattr(sys, "argv", ["lerobot", *ROBOT, folder, *words])
        module.main()

    return main


@pytest.fixture
def observed(monkeypatch):
    """What the robot says to LeRobot's loop, in order."""
    seen, plain = [], HandrailSim.get_observation

    def noted(robot):
        seen.append(plain(robot))
        return seen[-1]

    monkeypatch.setattr(HandrailSim, "get_observation", noted)
    return seen


def test_lerobot_replays_its_recording_to_the_same_motion(run, observed, tmp_path):
    root = tmp_path / "set"
    script = (f"--teleop.calibration_dir={tmp_path}", "--teleop.type=handrail_scripted")
    times = ("--teleop.episode_time_s=3", "--teleop.reset_time_s=1")
    where = ("--dataset.repo_id=me/set", f"--dataset.root={root}")
    what = ("--dataset.single_task=reach", "--dataset.fps=20", "--dataset.num_episodes=2")
    phases = ("--dataset.episode_time_s=3", "--dataset.reset_time_s=1", "--dataset.push_to_hub=false")
    run(lerobot_record, *script, *times, *where, *what, *phases, "--play_sounds=false")
    names = read_info(root).features["observation.state"].names
    assert names
    assert len(read_episodes(root)) == 2
    for number in range(2):
        frames = read_frames(root, number, ["action", "observation.state"])
        assert set(frames["observation.state"][:, names.index("scene")]) == {number}
        assert np.abs(frames["action"]).max() > 0.05
        observed.clear()
        run(
            lerobot_replay,
            *where,
            f"--dataset.episode={number}",
            f"--robot.episode={number}",
            "--play_sounds=false",
        )
        states = np.array([[moment[name] for name in names] for moment in observed], np.float32)
        recorded = frames["observation.state"]
        waits = int(np.argmax((recorded != recorded[0]).any(axis=1)))  # LeRobot's clock is behind ours
        assert waits <= 3
        np.testing.assert_array_equal(states[0], recorded[0])
        np.testing.assert_allclose(states[waits:], recorded[waits:], atol=1e-9)


def test_lerobot_teleoperates_and_scenes_change(run, observed, tmp_path):
    script = ("--teleop.type=handrail_scripted", f"--teleop.calibration_dir={tmp_path}")
    run(lerobot_teleoperate, *script, "--teleop.reset_time_s=0.5", "--fps=20", "--teleop_time_s=15")
    assert max(moment["scene"] for moment in observed) >= 1
    assert sum(moment["success"] for moment in observed) > 0
