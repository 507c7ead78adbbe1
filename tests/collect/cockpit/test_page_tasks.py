"""Laws of the real page: who has its words and some keys, or two sticks, and no more, does the tasks.

The dataset that comes of it is a LeRobot dataset like any other.
"""

import subprocess
import sys

import numpy as np
import page_tasks
import pytest
from command_helpers import command

pytest.importorskip("playwright.sync_api", reason="the extra 'dev' is not installed")
from page_driver import PageDriver
from page_learner import Learner
from page_levers import Keys, Pad
from page_recording import recording, saved

pytestmark = pytest.mark.slow
PATIENT = ("--time_limit", "180")  # who tries what each key does takes longer, on a busy computer above all


def drive(new_page, folder, task, device, episodes, mode="ee", *flags):
    """Do a task some times, as somebody who sees the page for the first time."""
    flags = ("--task", task, "--mode", mode, "--dataset.num_episodes", episodes, *flags)
    with recording(folder, *flags) as (process, address):
        driver = PageDriver(new_page(device.SCRIPT), address)
        driver.begin()
        learner = Learner(driver, device(driver), mode.startswith("direct"))
        driver.set_speed(1.0)
        learner.learn()
        driver.press("ArrowLeft")  # that was to learn; now again, and it counts
        for _ in range(episodes):
            driver.begin()
            learner.begin()
            driver.set_speed(1.0)
            getattr(page_tasks, task)(learner)
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


@pytest.fixture(scope="module")
def reached(tmp_path_factory):
    return tmp_path_factory.mktemp("page") / "reach"


def test_reach_by_keys(new_page, reached):
    """Who holds the keys for what the page says is left gets there; nothing has to be tried or measured."""
    with recording(reached, "--task", "reach", "--dataset.num_episodes", 5) as (process, address):
        driver = PageDriver(new_page(), address)
        for _ in range(5):
            driver.begin()
            page_tasks.follow_words(driver)
        assert process.wait(60) == 0
    check(reached, 5, "keyboard")


@pytest.mark.parametrize("frame", ["world", "base", "tool"])
def test_the_words_hold_whatever_the_hand_goes_along(new_page, tmp_path, frame):
    with recording(tmp_path / "reach", "--task", "reach", "--dataset.num_episodes", 1) as (process, address):
        driver = PageDriver(new_page(), address)
        driver.begin()
        driver.choose("frame", frame)
        page_tasks.follow_words(driver)
        assert process.wait(60) == 0
    check(tmp_path / "reach", 1, "keyboard")


def test_pick_place_by_keys(new_page, tmp_path):
    drive(new_page, tmp_path / "pick", "pick_place", Keys, 5, "ee", *PATIENT)
    check(tmp_path / "pick", 5, "keyboard", fewest=4)


def test_pick_place_by_sticks(new_page, tmp_path):
    drive(new_page, tmp_path / "pick", "pick_place", Pad, 3, "ee", *PATIENT)
    check(tmp_path / "pick", 3, "gamepad")


def test_reach_by_the_keys_of_every_joint(new_page, tmp_path):
    """Nobody is told what a joint's key does to the hand; they find out, within a longer time."""
    drive(new_page, tmp_path / "reach", "reach", Keys, 1, "direct", *PATIENT)
    check(tmp_path / "reach", 1, "keyboard", "direct")


def test_what_was_driven_is_a_dataset_like_any_other(reached, tmp_path):
    """It opens in plain LeRobot, replays exactly, and trains."""
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    if not reached.is_dir():
        pytest.skip("nothing was driven before")
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
        tmp_path / "policy",
        *("--steps", 4, "--batch_size", 4, "--device", "cpu"),
        name="train",
    )
    assert trained.returncode == 0, trained.stderr
