"""Laws of the real page: what becomes of an episode is what the person said, and the data have no more."""

import numpy as np
import pytest
from judges import doctor_fails, lint_defects
from page_recording import driven, hand_columns, is_smooth, is_whole, rows, saved
from playwright.sync_api import expect

pytestmark = pytest.mark.slow


def test_discarded_episodes_are_not_saved(new_page, tmp_path):
    """Thrown away: another scene. Again: the same one. Practice: as if it had not been."""
    with driven(new_page, tmp_path / "d", "--task", "reach") as driver:
        first = driver.place("goal")
        driver.push("KeyW", 0.5)
        driver.press("Backspace")
        driver.expect_phase("ready: press Start")
        assert driver.wait(lambda: np.any(driver.place("goal") != first))
        second = driver.place("goal")
        driver.begin()
        driver.push("KeyW", 0.5)
        moved = driver.place()
        driver.press("ArrowLeft")
        driver.expect_phase("ready: press Start")
        assert driver.wait(lambda: np.abs(driver.place() - moved).max() > 0.01)
        assert np.array_equal(driver.place("goal"), second)
        driver.at("practice").check()
        driver.begin("practice: not recorded")
        driver.push("KeyW", 0.5)
        driver.press("ArrowRight")
        driver.expect_phase("ready: press Start")
        assert driver.text("saved").startswith("0 saved")
        assert driver.at("episodes").locator("li").count() == 3
        driver.end()
    assert saved(tmp_path / "d") == []


def test_the_person_s_word_is_kept_beside_the_judge_s(new_page, tmp_path):
    """Where they differ the page says so first; what counts as a success is what the judge says."""
    with driven(new_page, tmp_path / "d", "--task", "reach", "--dataset.num_episodes", 2) as driver:
        driver.push("KeyS", 0.6)
        driver.press("ArrowDown")
        driver.begin()
        driver.push("KeyS", 0.6)
        driver.press("ArrowRight")
        expect(driver.at("decision")).to_contain_text("The task's judge says: not done (goal: ")
        driver.expect_phase("paused")
        driver.press("Escape")
        expect(driver.at("decision")).to_be_hidden()
        driver.press("Enter")
        driver.expect_phase("recording")
        driver.done()
    assert [row["success"] for row in rows(tmp_path / "d")] == [False, False]
    assert [row["operator_says"] for row in rows(tmp_path / "d")] == ["failure", "success"]
    assert [row["failure_reason"] for row in rows(tmp_path / "d")] == ["operator: failure", "judge: not done"]
    assert [each["next.success"][-1] for each in saved(tmp_path / "d")] == [False, False]


def test_esc_ends_nothing_and_the_end_of_a_recording_loses_nothing(new_page, tmp_path):
    with driven(new_page, tmp_path / "d", "--task", "reach") as driver:
        driver.push("KeyS", 0.6)
        for _ in range(3):
            driver.press("Escape")
        driver.push("KeyS", 0.6)  # what Esc ended would be over by then
        assert driver.phase == "recording"
        driver.press("End")
        expect(driver.at("decision")).to_contain_text("An episode is open")
        driver.press("Enter")  # go on
        driver.expect_phase("recording")
        driver.push("KeyS", 0.4)
        driver.end(save="ArrowDown")
    assert [row["operator_says"] for row in rows(tmp_path / "d")] == ["failure"]


def test_undo_goes_back_to_the_pause(new_page, tmp_path):
    """What came after it never was, but for its mark; the path that is recorded has no gap."""
    with driven(new_page, tmp_path / "d", "--task", "reach", "--dataset.num_episodes", 1) as driver:
        driver.push("KeyS", 0.8)
        driver.press("KeyP")
        driver.expect_phase("paused")
        driver.page.wait_for_timeout(1500)  # the robot brakes to rest first: that is what one goes back to
        paused = driver.settled()
        driver.press("Enter")
        driver.expect_phase("recording")
        driver.push("KeyF", 0.8)
        wrong = driver.settled()
        assert np.abs(wrong - paused).max() > 0.03
        driver.press("Backquote")
        assert driver.wait(lambda: np.abs(driver.place() - paused).max() < 0.003)
        driver.expect_phase("paused")
        driver.press("Enter")
        driver.expect_phase("recording")
        driver.push("KeyS", 0.5)
        driver.done()
    (frames,) = saved(tmp_path / "d")
    assert [row["undos"] for row in rows(tmp_path / "d")] == [1]
    assert sorted(set(frames["teleop.undos"])) == [0, 1]
    assert is_whole(frames)
    assert is_smooth(frames)
    hand = np.array(frames["observation.state"])[:, hand_columns(tmp_path / "d")]
    assert np.linalg.norm(np.diff(hand, axis=0), axis=1).max() < 0.05
    assert hand[:, 2].min() > paused[2] - 0.02  # it was never where the undone part went


def test_the_mode_changes_in_motion_without_a_jolt(new_page, tmp_path):
    """Through every kind of controller, while keys stay held; nothing is let go of."""
    keys = ("KeyS", "KeyI", "Digit1")  # of the hand, the base, the arm
    modes = ("base+ee", "direct", "switching", "joints", "decoupled", "direct_cbf", "direct_filtered", "ee")
    with driven(new_page, tmp_path / "d", "--task", "reach", "--dataset.num_episodes", 1) as driver:
        driver.page.wait_for_timeout(3000)  # a browser that has just begun draws slowly
        for key in keys:
            driver.page.keyboard.down(key)
        for mode in modes:
            driver.page.wait_for_timeout(500)
            before = driver.text("mode-help")
            driver.choose("mode", mode)
            expect(driver.at("mode-help")).not_to_have_text(before)  # its controller has taken over
            driver.page.evaluate("document.activeElement.blur()")
            driver.page.keyboard.up("Digit1")  # what meant nothing when it was pressed means nothing now
            driver.page.keyboard.down("Digit1")
        driver.page.wait_for_timeout(500)
        for key in keys:
            driver.page.keyboard.up(key)
        driver.press("ArrowDown")
    (frames,) = saved(tmp_path / "d")
    said = frames["teleop.mode"]
    assert set(said) == {"ee", *modes}
    changes = [index for index in range(1, len(said)) if said[index] != said[index - 1]]
    speed = np.abs(np.array(frames["action"])[:, :-1]).max(axis=1)
    assert sum(speed[index - 1] > 0.02 for index in changes) >= 5  # it did move
    assert is_smooth(frames)
    assert is_whole(frames)
    assert not doctor_fails(tmp_path / "d")
    assert not lint_defects(tmp_path / "d")
