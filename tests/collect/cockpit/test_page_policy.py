"""Laws of the real page beside a policy: whoever watches ranks above it, and sees who drives what.

The policy of these laws is an ACT that nobody has trained: it drives, and does no task.
"""

import subprocess
import sys
import time

import numpy as np
import pytest
from cockpit_witness import Relay, Witness, closing, is_moving, is_still
from page_driver import PageDriver
from page_recording import Recording, recording, rows, saved
from page_supervisor import PageSupervisor, to_the_aim
from playwright.sync_api import expect
from policy_helpers import untrained_act

from handrail.datasets.recording.frames import BY_PERSON

pytestmark = pytest.mark.slow
HAND = slice(3, 9)  # channels of the only hand


@pytest.fixture(scope="module")
def policy(tmp_path_factory):
    return untrained_act(tmp_path_factory.mktemp("policy") / "act", "intent")


@pytest.fixture(scope="module")
def beside(tmp_path_factory, policy):
    flags = ("--task", "reach", "--policy", policy, "--dataset.num_episodes", 100, "--time_limit", 600)
    with closing(Recording(tmp_path_factory.mktemp("beside"), *flags)) as made:
        yield made


@pytest.fixture
def witness(beside):
    with closing(Witness(beside.address)) as made:
        made.make_ready()
        yield made


def drives(frame, who):
    return bool(frame["drivers"][who])


def may_drive(driver):
    """Whether the page has the lease; ask for it where somebody else had it last."""
    button = driver.page.locator("#drives button", has_text="Drive")
    if button.count():
        button.first.click()
    return driver.at("start").is_enabled()


def go(driver, witness):
    """Press Start until the policy drives: a busy computer may be late, and that pauses."""
    end = time.monotonic() + 60.0
    while not (witness.frame["phase"] == "driving" and drives(witness.frame, "policy")):
        assert time.monotonic() < end, witness.frame["phase"]
        if witness.frame["phase"] in ("ready", "paused"):
            driver.press("Enter")
        time.sleep(0.5)
    witness.until(is_moving)


@pytest.fixture
def driven(new_page, beside, witness):
    """A page beside a policy that drives, over a cable that can be pulled."""
    with closing(Relay(beside.address)) as relay:
        driver = PageDriver(new_page(), relay.address)
        assert driver.wait(lambda: may_drive(driver))
        go(driver, witness)
        yield driver, relay
        driver.page.close()
        time.sleep(0.5)
    if witness.frame["phase"] != "ready":
        witness.end_episode()


def stays_still(witness, phase):
    """The robot comes to rest, and is there a second later, whoever has let go of what."""
    witness.until(lambda frame: frame["phase"] == phase and is_still(frame))
    for _ in range(20):
        time.sleep(0.05)
        assert witness.frame["phase"] == phase
        assert is_still(witness.frame)
        assert not drives(witness.frame, "policy")


def test_stop_and_pause_brake_the_policy_until_the_person_goes_on(driven, witness):
    driver, _ = driven
    driver.press("Space")
    stays_still(witness, "stopped")
    expect(driver.at("drivers")).to_contain_text("the policy stands still, too")
    driver.press("Enter")
    stays_still(witness, "paused")
    go(driver, witness)
    driver.press("KeyP")
    stays_still(witness, "paused")
    go(driver, witness)


def test_a_policy_pauses_while_a_list_has_the_keys(driven, witness):
    driver, _ = driven
    driver.page.locator("#mode").click()
    stays_still(witness, "paused")


def test_a_lost_link_brakes_the_policy_and_it_does_not_go_on_by_itself(driven, witness):
    """Nothing was held when the cable was pulled; when it is back, nothing is."""
    driver, relay = driven
    relay.is_cut = True
    stays_still(witness, "paused")
    relay.is_cut = False
    stays_still(witness, "paused")
    go(driver, witness)
    driver.page.evaluate("dispatchEvent(new Event('blur'))")
    stays_still(witness, "paused")
    driver.page.evaluate("dispatchEvent(new Event('focus'))")
    stays_still(witness, "paused")
    go(driver, witness)


def test_the_person_ends_the_episode_while_the_policy_drives(driven, witness):
    driver, _ = driven
    before = witness.frame["saved"]
    driver.press("ArrowLeft")  # again
    witness.until(lambda frame: frame["phase"] == "ready")
    assert witness.frame["saved"] == before
    go(driver, witness)
    driver.press("ArrowDown")  # failed
    witness.until(lambda frame: frame["saved"] == before + 1)
    go(driver, witness)
    driver.done()
    witness.until(lambda frame: frame["saved"] == before + 2)


def test_moved_channels_are_the_persons_and_the_page_says_so(driven, witness):
    driver, _ = driven
    hand = driver.at("owned").get_by_role("button", name="you own the hand")
    expect(driver.at("drivers")).to_contain_text("The policy drives the hand. Hold a key to take the hand.")
    expect(hand).to_have_text("◆ hand: policy")
    assert not any(witness.frame["ghosts"])  # the person leads nothing
    driver.page.keyboard.down("KeyR")
    witness.until(lambda frame: drives(frame, "person") and not drives(frame, "policy"))
    expect(driver.at("drivers")).to_contain_text("You drive the hand, the policy waits.")
    expect(hand).to_have_text("● hand: you")
    driver.page.keyboard.up("KeyR")
    witness.until(lambda frame: drives(frame, "policy") or frame["phase"] == "paused")


def test_a_page_without_a_policy_says_nothing_of_one(on_bench):
    _, driver = on_bench()
    assert driver.at("drivers").is_hidden()
    assert "policy" not in driver.page.inner_text("body").lower()
    expect(driver.at("owned-title")).to_have_text("You own")


def test_a_policy_that_fails_is_helped_to_success_with_the_keys_of_the_hand(new_page, tmp_path, policy):
    flags = ("--task", "reach", "--policy", policy, "--time_limit", 300, "--dataset.num_episodes", 2)
    with recording(tmp_path / "d", *flags) as (process, address):
        driver = PageDriver(new_page(), address)
        for _ in range(2):
            driver.begin()
            PageSupervisor(driver).supervise(to_the_aim, 900.0)
            assert driver.wait(lambda: driver.phase.startswith(("ready", "no connection")))
        assert process.wait(90) == 0
    done = [bool(each["next.success"][-1]) for each in saved(tmp_path / "d")]
    assert done == [True, True]
    assert len(rows(tmp_path / "d")) == 2
    for each in saved(tmp_path / "d"):
        check_owners(each)
    words = [sys.executable, "-m", "handrail.scripts", "replay", tmp_path / "d"]
    replay = subprocess.run(words, capture_output=True, text=True)
    assert replay.returncode == 0, replay.stderr
    assert [line.split()[1] for line in replay.stdout.splitlines()[3:5]] == ["0.00e+00"] * 2


def check_owners(frames):
    """The hand and its gripper were the person's while a key of it was held, and 0.5 s more; nothing else."""
    pressed = np.array(frames["teleop.raw"]) != 0
    owner, keys = np.array(frames["owner"]), pressed[:, HAND].any(axis=1)
    assert not np.delete(pressed, HAND, axis=1).any()
    assert not np.any(np.delete(owner, [*range(HAND.start, HAND.stop), -1], axis=1) == BY_PERSON)
    taken, lately = (
        np.any(owner[:, HAND] == BY_PERSON, axis=1),
        np.convolve(keys, np.ones(11))[: len(keys)] > 0,
    )
    assert keys.any()
    assert not np.any(taken & ~lately)
    assert not np.any(keys & ~taken & owner.any(axis=1))  # nobody is an owner while the robot brakes
    assert np.all(owner[taken, -1] == BY_PERSON)
    assert np.array_equal(np.array(frames["intervention"]), (owner == BY_PERSON).any(axis=1))
