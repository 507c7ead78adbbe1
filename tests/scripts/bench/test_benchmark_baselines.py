"""Who else takes part: the paper's own horizon, and baselines behind the masked MPC's low-pass."""

from dataclasses import replace

import numpy as np
import pytest

from handrail.collect.world.tasks.goal_reaching import STEP
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.prediction import after
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.robot.model import load_model
from handrail.scripts.bench.goal_reaching.baselines import (
    goal_reaching_prediction,
    hand_intent,
    smoothed_hand_intent,
)
from handrail.scripts.bench.goal_reaching.config import BASELINES, BenchmarkConfig
from handrail.scripts.bench.goal_reaching.run import trace_of

MODEL = load_model()
CHANNELS = Channels.of(MODEL.description)
STATE = State(MODEL.description.home, np.zeros(9))
IDEAL = BenchmarkConfig(goals=1, seed=103, physics=False)
KEYS = replace(IDEAL, profile="quantised")


def test_a_baseline_s_low_pass_is_the_mpc_s():
    """At every moment it sends what the MPC's prediction says of that moment, rests and gaps included."""
    twists = np.random.default_rng(0).normal(size=(40, 6))
    twists[10:20] = 0.0
    times = np.cumsum(np.random.default_rng(1).choice([STEP, 0.0, 0.5], 40, p=[0.8, 0.1, 0.1]))
    hand, smooth = hand_intent(MODEL), smoothed_hand_intent(MODEL)
    predict = goal_reaching_prediction(CHANNELS)
    for twist, time in zip(twists, times, strict=True):
        asked = hand(twist, STATE, time)
        predict = after(predict, asked)
        expected = predict(asked, np.array([0.0, 0.5, 1.0]))[0]
        sent = smooth(twist, STATE, time)
        np.testing.assert_allclose(sent.values, expected)
        assert (sent.time, sent.mask.tolist()) == (time, CHANNELS.mask("ee").tolist())


def test_the_low_pass_begins_at_rest_in_every_episode():
    who = replace(BASELINES["dls"], operator=smoothed_hand_intent)
    first, second = (trace_of(KEYS, who, 0)[1] for _ in range(2))
    np.testing.assert_array_equal(first.v, second.v)


@pytest.mark.parametrize("name", ["mpc_paper", "mpc", "mpc_one_stage"])
def test_no_update_comes_so_late_that_the_certified_stop_begins(name):
    """The simulation's steps decide when a controller is asked, not its period alone."""
    baseline = BASELINES[name]
    mpc = baseline.controller(MODEL)
    assert isinstance(mpc, MaskedMpc)
    assert STEP * np.ceil(round((baseline.period or STEP) / STEP, 9)) <= mpc.settings.dt
