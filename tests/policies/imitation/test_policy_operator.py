"""A trained policy beside a person: one bad row of its plan brakes; its plan waits for the robot."""

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

DRIVES = asks("base", "ee", value=0.1)
ROWS = np.full((8, 7), 0.1)


class Plans:
    """A policy that wants the same all the time, and has planned some rows."""

    encoder = None

    def __init__(self):
        self.rows, self.asked = ROWS, 0

    def reset(self):
        pass

    def act(self, *observation):
        self.asked += 1
        return ROWS[0]

    def planned(self):
        return self.rows


def shared(policy) -> Any:
    """Return a person who rests beside a policy whose action is the hand's six numbers and the gripper."""
    names = channels_of(ONE).names[3:9]
    interface = SimpleNamespace(
        action_names=(*names, "gripper"),
        observe=lambda state, environment: (state, environment),
        decode=lambda action, state: Intent(DRIVES.values * action[0] / 0.1, DRIVES.mask),
    )
    checkpoint = SimpleNamespace(meta=SimpleNamespace(mode="base+ee", interface=interface))
    env = SimpleNamespace(model=ONE, task=SimpleNamespace(description=""))
    operator = PolicyOperator(policy, checkpoint, env, PERIOD)  # pyright: ignore[reportArgumentType]
    made = SharedOperator(Fake(asks()), operator, arbiter("by_mask"), ONE)
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
