"""A trained policy beside a person: a bad row brakes, its plan waits for the robot, an undo is one."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from arbiter_helpers import ONE, PERIOD, Fake, arbiter, asks, channels_of

from handrail.collect.operators.operator import View
from handrail.collect.operators.shared.shared_operator import SharedOperator
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import LONG_AGO, Intent
from handrail.controllers.interface.sources import POLICY
from handrail.policies.imitation.evaluation.policy_operator import PolicyOperator
from handrail.policies.imitation.interface.encoder import Said
from handrail.policies.imitation.interface.scene_memory import SceneMemory

DRIVES = asks("base", "ee", value=0.1)
ROWS = np.full((8, 7), 0.1)


class Plans:
    """A policy that wants the same all the time, and has planned some rows."""

    encoder: Any = None

    def __init__(self):
        self.rows, self.asked = ROWS, 0

    def reset(self):
        pass

    def act(self, *observation):
        self.asked += 1
        return ROWS[0]

    def planned(self):
        return self.rows


def driver(policy) -> Any:
    """Return the operator of a policy whose action is the hand's six numbers and the gripper."""
    names = channels_of(ONE).names[3:9]
    interface = SimpleNamespace(
        action_names=(*names, "gripper"),
        observe=lambda state, environment: (state, environment),
        decode=lambda action, state: Intent(DRIVES.values * action[0] / 0.1, DRIVES.mask),
    )
    checkpoint = SimpleNamespace(meta=SimpleNamespace(mode="base+ee", task="", interface=interface))
    env = SimpleNamespace(model=ONE, task=SimpleNamespace(description=""))
    return PolicyOperator(policy, checkpoint, env, PERIOD)  # pyright: ignore[reportArgumentType]


def shared(policy) -> Any:
    """Return a person who rests beside the policy."""
    made = SharedOperator(Fake(asks()), driver(policy), arbiter("by_mask"), ONE)
    made.reset(view(0.0), np.random.default_rng(0))
    return made


def view(time):
    state = State(ONE.description.home, np.zeros(ONE.size), time)
    seen = {"agent_pos": np.zeros(3), "environment_state": np.zeros(2)}
    return View(state, None, seen)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    "rows",
    [np.vstack([ROWS, bad * ROWS[:1]]) for bad in (np.nan, np.inf)] + [ROWS[:, :6]],
    ids=["NaN", "inf", "six of seven numbers"],
)
def test_a_row_of_later_that_makes_no_sense_brakes_now(rows):
    policy = Plans()
    operator = shared(policy)
    for period in range(1, 25):
        found = operator.act(view(PERIOD * period))
    assert found.time == pytest.approx(PERIOD * 24)
    ahead = found.source(POLICY).predict
    assert np.allclose(ahead.times - found.time, PERIOD * np.arange(9))
    policy.rows = rows
    found = operator.act(view(PERIOD * 25))
    assert found.time == LONG_AGO
    policy.rows = ROWS
    assert operator.act(view(PERIOD * 26)).time == pytest.approx(PERIOD * 26)


def test_while_the_robot_is_not_heard_the_plan_stands_still():
    policy = Plans()
    operator = shared(policy)
    found = [operator.act(view(time)) for time in (0.05, 0.1, 0.1, 0.1, 0.15)]
    assert policy.asked == 3
    times = [each.source(POLICY).predict.times[0] for each in found]
    assert times == pytest.approx([0.05, 0.1, 0.1, 0.1, 0.15])


class Looks:
    """An encoder that says where one thing is."""

    def __init__(self):
        self.x = 1.0
        self.reads = SimpleNamespace(
            objects=[("cube", ("x", "y", "z"), 0)],
            turns={},
            movable=("cube",),
            check_robot=lambda model: None,
            interface=SimpleNamespace(environment_names=("cube.x", "cube.y", "cube.z")),
        )

    def read(self, pictures):
        return ()

    def said(self, numbers, states, hands=(1.0,)):
        tools = np.array(hands)[None, :, None] * [1.0, 0.0, 0.0]
        return {"cube": [Said(tools, np.array([[self.x, 0.0, 0.0]]), 0.01 * np.eye(3)[None])]}


def test_after_an_undo_what_was_seen_since_is_forgotten():
    """Law: the policy sees what it would have seen without, bit by bit; what was known before is kept."""
    found = []
    for undone in ([], [(0.25, 1.2), (0.3, 1.4), (0.35, 1.4)]):
        policy, seen = Plans(), []
        policy.encoder = Looks()
        operator = shared(policy)
        policy.act = lambda state, around, *rest, seen=seen: seen.append(around) or ROWS[0]
        later = [(0.25, 1.1), (0.3, 1.1), (0.35, 1.1)]
        for time, x in [(0.05, 1.0), (0.1, 1.1), (0.15, 1.0), (0.2, 0.9), *undone, *later]:
            policy.encoder.x = x
            operator.act(view(time))
        found.append(seen[-3:])
    np.testing.assert_array_equal(*found)


def test_the_pictures_of_a_moment_count_once():
    """Asked again at the same time, as after a hand-back, a policy sees the same again."""
    policy, seen = Plans(), []
    policy.encoder = Looks()
    operator = driver(policy)
    operator.reset(view(0.0), np.random.default_rng(0))
    policy.act = lambda state, around, *rest: seen.append(around) or ROWS[0]
    for time, x in [(0.05, 1.0), (0.1, 1.2), (0.1, 1.2)]:
        policy.encoder.x = x
        operator.act(view(time))
        operator.replan()
    np.testing.assert_array_equal(*seen[-2:])


def test_what_any_hand_reaches_may_move():
    """Law: a cube that a hand carries is where it is seen now, whichever of two that is."""
    places = []
    for hands in ([1.0], [9.0, 1.0], [9.0]):
        encoder = Looks()
        memory = SceneMemory(encoder.reads)
        for encoder.x in np.linspace(1.0, 1.3, 20):
            found = memory.take(encoder.said((), {}, hands), 0)
        places.append(float(found[0]))
    assert places[0] == places[1]
    assert places[1] > places[2] + 0.05
