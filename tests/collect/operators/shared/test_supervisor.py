"""Laws of who supervises a policy: what nobody could help with, or would never ask for help, is refused."""

from contextlib import closing
from typing import Any

import numpy as np
import pytest
from command_helpers import refused
from policy_helpers import untrained_act

from handrail.collect.config import SessionConfig
from handrail.collect.session.build import build_env, build_mode, build_operator
from handrail.collect.session.loop import EpisodeLoop
from handrail.controllers.baselines.direct import DirectController
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels

OPERATOR = "hand_supervisor"
WORDS = ("--task", "reach", "--no_physics", "--operator", "supervisor")


@pytest.fixture(scope="module")
def env():
    with closing(build_env(SessionConfig(task="reach", physics=False), 20)) as made:
        yield made


def supervisor(env, **settings):
    config = SessionConfig(task="reach", operator=OPERATOR, **settings)
    return build_operator(config, build_mode(config, env.model), env.model)


@pytest.mark.parametrize("settings", [{"mode": "base+ee"}, {"mode": "ee"}, {"mask": "1" * 18}])
def test_the_base_stays_the_policys(env, settings):
    made, channels = supervisor(env, **settings), Channels.of(env.model.description)
    view = EpisodeLoop(env, DirectController(env.model, env.period)).begin(0)
    made.reset(view, np.random.default_rng(0))
    intent: Any = made.act(view)
    assert np.array_equal(intent.mask, channels.mask("ee"))


@pytest.mark.parametrize("mode", ["base", "joints", "switching"])
def test_a_mode_that_does_not_steer_the_hand_throughout_is_refused(env, mode):
    with pytest.raises(HandrailError, match=rf"^--operator hand_supervisor: expected .*, got {mode}$"):
        supervisor(env, mode=mode)


def test_one_policy_is_no_ensemble_whose_doubt_could_ask_for_help(tmp_path):
    refused(tmp_path, *WORDS, "--policy", "one", "--arbiter", "risk", told="--arbiter risk: expected several")


def test_a_policy_of_another_rate_is_refused_by_the_flag_that_was_said(tmp_path):
    policy = untrained_act(tmp_path / "act", "intent")
    for flag, rate in (("--robot_fps", "40"), ("--dataset.fps", "40")):
        told = f"expected {flag} 20, as it was trained, got 40"
        refused(tmp_path / "set", *WORDS, "--policy", policy, flag, rate, told=told)
