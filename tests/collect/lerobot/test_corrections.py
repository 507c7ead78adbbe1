"""A policy drives LeRobot's robot, a person looks on and takes over: pauses rest, the e-stop counts."""

import time

import numpy as np
import pytest
from lerobot_helpers import loop, steered

from handrail.collect.lerobot import HandrailScriptedConfig
from handrail.collect.lerobot.mode_action import NEXT
from handrail.collect.lerobot.teleoperator import SimTeleoperator
from handrail.collect.operators.person.inputs import Ask, Input
from handrail.collect.operators.person.person import Person

GRIPPER = "gripper.pos"


class ByHand(Person):
    """A person whose device a test holds."""

    axes: tuple[float, ...] = (0.0,) * 18
    closes = False

    @property
    def person(self):
        return self

    def begin(self, env, seed):
        self.shown = 0

    def see(self, frame):
        self.shown += 1

    def close(self):
        """There is nothing to give back."""

    def act(self, view):
        self.take(Input(True, "hand", (self.closes,), self.axes, 0.0, ()), time.monotonic())
        return super().act(view)


class HandTeleoperator(SimTeleoperator):
    """Somebody beside a policy."""

    config_class, name = HandrailScriptedConfig, "by_hand"

    def _made(self, robot):
        self.hand = ByHand(robot.env.model, {robot.mode.name: robot.mode}, robot.mode.name)
        return self.hand


@pytest.fixture
def beside(tmp_path):
    """A robot that a policy can drive, the action that it sends, and a person beside it."""
    with steered(tmp_path) as (robot, script):
        script.disconnect()
        teleop = HandTeleoperator(HandrailScriptedConfig(calibration_dir=tmp_path))
        teleop.connect()
        robot.send_action(robot.action.still())
        teleop.hand.ask(Ask("start"))
        yield robot, robot.action.still() | {"ee.x.vel": 0.2}, teleop


def test_the_same_action_once_more_comes_to_rest_and_equal_ones_go_on(tmp_path):
    with steered(tmp_path) as (robot, teleop):
        action = loop(robot, teleop, 30)[-1]
        for _ in range(30):
            robot.send_action(dict(action))
        assert np.abs(robot.view.state.v).max() > 0.05
        for _ in range(60):
            robot.send_action(action)
        resting = robot.get_observation()
        assert not any(resting[f"sent.{name}"] for name in robot.env.model.joints)
        robot.send_action(action)
        assert robot.get_observation() == resting
        action["ee.x.vel"] += 0.01  # a program's own, changed in place
        robot.send_action(action)
        assert robot.get_observation() != resting


def test_an_action_with_a_button_presses_it_once(tmp_path):
    with steered(tmp_path) as (robot, _):
        action = robot.action.still() | {NEXT: 1.0}
        for _ in range(3):
            robot.send_action(action)
        assert robot.scene == 1


def test_a_person_who_looks_on_is_shown_everything_and_their_e_stop_stops_a_policy(beside):
    robot, policy, teleop = beside
    for _ in range(20):
        robot.send_action(dict(policy))
    assert teleop.hand.shown == 20
    teleop.hand.ask(Ask("stop"))
    for _ in range(40):
        robot.send_action(dict(policy))
    assert not robot.view.state.commanded.any()
    teleop.hand.ask(Ask("stop", False))
    for _ in range(5):
        robot.send_action(dict(policy))
    assert robot.view.state.commanded.any()


@pytest.mark.parametrize(("what", "scene"), [("success", 1), ("failure", 1), ("discard", 1), ("restart", 0)])
@pytest.mark.parametrize("paused", [False, True])
def test_a_person_who_looks_on_changes_the_scene(what, scene, paused, beside):
    robot, policy, teleop = beside
    robot.send_action(policy)
    episodes = robot.episodes
    teleop.hand.ask(Ask(what))
    for _ in range(3):
        robot.send_action(policy if paused else dict(policy))
    assert (robot.scene, robot.episodes) == (scene, episodes + 1)


@pytest.mark.parametrize("before", [0.0, 1.0])
@pytest.mark.parametrize("closes", [False, True])
def test_a_gripper_stays_as_it_is_until_the_person_changes_it(before, closes, beside):
    robot, policy, teleop = beside
    robot.send_action(policy | {GRIPPER: before})
    teleop.hand.closes = closes
    for _ in range(2):
        action = teleop.get_action()
        robot.send_action(action)
        assert action[GRIPPER] == before
    teleop.hand.closes = not closes
    assert teleop.get_action()[GRIPPER] == 1.0 - before


def test_a_hand_over_brakes_and_the_pause_that_follows_moves_nothing(beside):
    robot, policy, teleop = beside
    for _ in range(19):
        robot.send_action(dict(policy))
    robot.send_action(policy)
    for _ in range(60):
        teleop.send_feedback(dict(policy))
    assert not robot.view.state.commanded.any()
    robot.send_action(policy)
    assert not robot.view.state.commanded.any()
