"""Tasks of two hands that take turns: a scripted person does them, and no hand can do them alone."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest

from handrail.collect.config import SessionConfig
from handrail.collect.seeds import episode_seed
from handrail.collect.session.build import build_env, build_session
from handrail.collect.world.tasks.drawer import opened
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import Pose

ROBOT, NAMES = "tiago_pro", {"hand_over": "HandOver", "fetch": "Fetch"}


class Watcher:
    def begin(self, env, seed):
        self.held, self.grippers, self.env = [""], set(), env

    def see(self, frame):
        self.grippers.add(frame.intent.grippers)
        for each in self.env.plant.held():
            if each.frame != self.held[-1]:
                self.held.append(each.frame)


@pytest.mark.parametrize(
    ("task", "hand", "held"),
    [("hand_over", "left", ["", "left.tool", "right.tool"]), ("fetch", "right", ["", "left.tool"])],
)
def test_a_person_does_it_with_one_hand_after_the_other(task, hand, held):
    config, watcher = SessionConfig(task=task, mode="both", robot=ROBOT, hand=hand), Watcher()
    outcome = build_session(config, build_env(config, 20), (watcher,)).run(1)
    assert outcome.success, outcome
    assert outcome.contact_onsets == 0
    assert watcher.held == held
    assert watcher.grippers == {(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)}


@pytest.mark.parametrize("hand", ["left", "right"])
def test_each_table_is_for_one_hand(hand):
    """So who takes the bar with one hand alone, whichever, fails on the way to the bin."""
    env = build_env(SessionConfig(task="hand_over", robot=ROBOT, hand=hand), 20)
    env.reset(seed=0)
    state, first = env.task_state(), env.model.number
    for place, wrong in (("cube", 1 - first), ("bin", first)):
        for at in (0, 1):
            bar = Pose(state.pose(place).position, np.eye(3))
            away = replace(state.tools[at], position=bar.position + [0.0, 0.0, 1.0])
            end = replace(away, position=bar.position + [0.0, 0.12, 0.02])
            tools = tuple(end if each == at else away for each in (0, 1))
            now = replace(state, poses={**state.poses, "cube": bar}, tools=tools, still=frozenset(["cube"]))
            verdict = env.task.outcome(now)
            assert (verdict.failure == "wrong_hand") == (at == wrong)
            assert not verdict.success  # a hand is at the bar yet


def test_a_drawer_that_nobody_holds_closes_before_the_hand_is_in_it():
    env = build_env(SessionConfig(task="fetch", robot=ROBOT, hand="left"), 20)
    env.reset(seed=0)
    env.simulation.data.joint("drawer").qpos[:] = 0.3
    for _ in range(40):
        env.step(np.zeros(env.model.size + 2))
    assert opened(env.task_state()) < 0.01
    assert not env.task.outcome(env.task_state()).over


@pytest.mark.slow
@pytest.mark.parametrize("hand", ["left", "right"])
@pytest.mark.parametrize("task", ["hand_over", "fetch"])
def test_a_person_does_it_every_time(task, hand):
    config = SessionConfig(task=task, mode="both", robot=ROBOT, hand=hand)
    session = build_session(config, build_env(config, 20))
    outcomes = [session.run(episode_seed(7500, number)) for number in range(5)]
    assert [outcome.failure_reason for outcome in outcomes] == [""] * 5
    assert not any(outcome.contact_onsets for outcome in outcomes)


@pytest.mark.parametrize("task", ["hand_over", "fetch"])
def test_a_small_robot_is_refused_in_a_line(task):
    said = (
        f"task {task}: .* world has scale 1, got bi_so101 with 0.3; it can do pick_place, reach, reach_both"
    )
    with pytest.raises(HandrailError, match=said):
        build_env(SessionConfig(task=task, robot="bi_so101"), 20)
    with pytest.raises(HandrailError, match=f"task {task}: "):
        gymnasium.make(f"handrail/{NAMES[task]}-v0", robot="bi_so101").reset(seed=0)


@pytest.mark.parametrize("task", ["hand_over", "fetch", "reach_both"])
def test_hands_that_move_as_one_cannot_take_turns(task):
    config = SessionConfig(task=task, mode="pair", robot=ROBOT)
    with pytest.raises(HandrailError, match=f"mode pair: the script of task {task} expected .* mode both"):
        build_session(config, build_env(config, 20))


@pytest.mark.parametrize("mode", ["ee", "hand+torso", "switching"])
@pytest.mark.parametrize("task", ["carry_box", "wide_tray", "hand_over", "fetch", "reach_both"])
def test_one_hand_cannot_do_what_takes_two(task, mode):
    config = SessionConfig(task=task, mode=mode, robot=ROBOT)
    with pytest.raises(HandrailError, match="expected both hands steered, as in mode both; got one"):
        build_session(config, build_env(config, 20))
