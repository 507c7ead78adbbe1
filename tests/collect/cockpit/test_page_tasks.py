"""Laws of the real page: who has its words and some keys, or two sticks, and no more, does the tasks.

The dataset that comes of it is a LeRobot dataset like any other.
"""

import os
import subprocess
import sys

import numpy as np
import page_tasks
import pytest
from command_helpers import command
from page_driver import PageDriver
from page_learner import Learner
from page_levers import Keys, Pad
from page_pair import PairDriver, PairKeys, PairLearner, PairPad, carry_box
from page_recording import recording, saved

pytestmark = pytest.mark.slow
PATIENT = ("--time_limit", "180")  # who tries what each key does takes longer, on a busy computer above all


def drive(new_page, folder, does, device, episodes, mode, person=(PageDriver, Learner), *more):
    """Do a task some times, as somebody who sees the page for the first time, or knows it."""
    flags = ("--task", does.__name__, "--mode", mode, "--dataset.num_episodes", episodes, *PATIENT, *more)
    with recording(folder, *flags) as (process, address):
        sees, learns = person
        driver = sees(new_page(sees.SCRIPT + device.SCRIPT), address)
        driver.begin()
        learner = learns(driver, device(driver), mode.startswith("direct"))
        driver.set_speed(1.0)
        learner.learn()
        driver.press("ArrowLeft")  # that was to learn; now again, and it counts
        for _ in range(episodes):
            driver.begin()
            learner.begin()
            driver.set_speed(1.0)
            does(learner)
            assert driver.wait(lambda: page_tasks.over(driver), 100.0), driver.text("numbers")
        assert process.wait(60) == 0


def check(folder, episodes, device, mode="ee", fewest=None):
    """The dataset has the episodes, of whoever has that in hand; all are successes, or some."""
    found = saved(folder)
    assert len(found) == episodes
    done = [bool(each["next.success"][-1]) for each in found]
    print("done:", done, "frames:", [len(each["action"]) for each in found])
    assert sum(done) >= (fewest or episodes)
    for each in found:
        assert {"", device} >= set(each["teleop.device"]) >= {device}
        assert set(each["teleop.mode"]) == {mode}
        assert np.any(each["teleop.raw"])


def test_reach_by_keys(new_page, tmp_path):
    """Who holds the keys for what the page says is left gets there, whatever the hand goes along.

    The dataset is like any other: it opens in plain LeRobot, replays exactly, and trains.
    """
    reached = tmp_path / "reach"
    with recording(reached, "--task", "reach", "--dataset.num_episodes", 5) as (process, address):
        driver = PageDriver(new_page(), address)
        for frame in ("", "", "world", "base", "tool"):
            driver.begin()
            if frame:
                driver.choose("frame", frame)
            page_tasks.follow_words(driver)
        assert process.wait(60) == 0
    check(reached, 5, "keyboard")
    check_usable(reached, tmp_path / "policy")


@pytest.mark.parametrize(
    ("task", "levers", "device", "mode", "episodes", "fewest"),
    [
        (page_tasks.pick_place, Keys, "keyboard", "ee", 5, 4),
        (page_tasks.pick_place, Pad, "gamepad", "ee", 3, 3),
        (page_tasks.reach, Keys, "keyboard", "direct", 1, 1),
    ],
)
def test_trying_each_lever_does_the_task(new_page, tmp_path, task, levers, device, mode, episodes, fewest):
    """Nobody is told what a joint's key does to the hand; they find out, within a longer time."""
    drive(new_page, tmp_path / "d", task, levers, episodes, mode)
    check(tmp_path / "d", episodes, device, mode, fewest)


@pytest.mark.parametrize(("levers", "device"), [(PairKeys, "keyboard"), (PairPad, "gamepad")])
def test_a_page_that_knows_the_box_carries_it_with_both_hands(new_page, tmp_path, levers, device):
    """`HANDRAIL_CARRIED=5` for five times; how many of them went well is printed."""
    episodes, person = int(os.environ.get("HANDRAIL_CARRIED", "1")), (PairDriver, PairLearner)
    drive(new_page, tmp_path / "d", carry_box, levers, episodes, "pair", person, "--robot", "tiago_pro")
    check(tmp_path / "d", episodes, device, "pair", max(1, episodes * 3 // 5))


def check_usable(reached, policy):
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    plain = LeRobotDataset("somebody/reach", root=reached)
    assert plain.num_episodes == 5
    assert len(plain) == sum(len(each["action"]) for each in saved(reached))
    replay = subprocess.run(
        [sys.executable, "-m", "handrail.scripts", "replay", reached], capture_output=True, text=True
    )
    assert replay.returncode == 0, replay.stderr
    assert [line.split()[1] for line in replay.stdout.splitlines()[3:8]] == ["0.00e+00"] * 5
    trained = command(
        reached,
        "--output",
        policy,
        *("--steps", 4, "--batch_size", 4, "--device", "cpu"),
        name="train",
    )
    assert trained.returncode == 0, trained.stderr
