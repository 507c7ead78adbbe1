"""Laws of who supervises a policy: what nobody could help with, or would never ask for help, is refused."""

import json
from contextlib import closing
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest
from command_helpers import refused
from policy_helpers import untrained_act

from handrail.collect.commands.recording import session_columns
from handrail.collect.config import RecordConfig, SessionConfig
from handrail.collect.operators.modes import MODES
from handrail.collect.operators.shared.settings import ArbiterSettings
from handrail.collect.session.build import build_env, build_mode, build_operator
from handrail.collect.session.loop import EpisodeLoop
from handrail.controllers.baselines.direct import DirectController
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.policies.imitation.evaluation.copilot import share

OPERATOR = "hand_supervisor"
REAL = ("--task", "reach", "--robot", "lekiwi", "--robot_client", "lekiwi", "--policy", "one")
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


def test_they_help_a_policy_that_gets_no_nearer(env):
    """After 3 s without progress, as soon as their hand is on the stick."""
    made, loop = supervisor(env), EpisodeLoop(env, DirectController(env.model, env.period))
    view = loop.begin(0)
    made.reset(view, np.random.default_rng(0))
    helps = []
    for step in range(120):
        now: Any = made.act(replace(view, state=replace(view.state, time=step / 20)))
        helps.append(bool(now.values.any()))
    assert helps.index(True) / 20 == pytest.approx(3.0 + 0.7, abs=0.2)


@pytest.mark.parametrize("mode", ["base", "joints", "switching"])
def test_a_mode_that_does_not_steer_the_hand_throughout_is_refused(env, mode):
    with pytest.raises(HandrailError, match=rf"^--operator hand_supervisor: expected .*, got {mode}$"):
        supervisor(env, mode=mode)


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        ((*WORDS, "--policy", "one", "--arbiter", "risk"), "--arbiter risk: expected several folders"),
        (("--task", "reach", "--arbiter", "whole"), "--arbiter, --arbitration: expected --policy too"),
        (
            ("--task", "reach", "--arbitration.alpha", "0.4"),
            "--arbiter, --arbitration: expected --policy too",
        ),
        ((*REAL, "--operator", "supervisor"), "--operator supervisor: expected a person"),
        ((*REAL, "--operator", "scripted"), "--operator scripted: expected a person"),
    ],
)
def test_a_task_that_nobody_could_supervise_is_refused(tmp_path, flags, told):
    refused(tmp_path / "set", *flags, told=told)


def test_modes_beside_a_policy_are_listed_for_this_robot(env):
    """A mode of two hands is no choice of a robot with one."""
    with pytest.raises(HandrailError, match="expected one that the MPC completes") as error:
        share(RecordConfig(task="reach", mode="direct", policy=("none",)), supervisor(env), env)
    choices = {MODES[name] for name in str(error.value).rpartition(": ")[2].split(", ")}
    assert MODES["ee"] in choices
    assert {mode.hands for mode in choices} == {1}


def test_an_episode_says_who_shared_it():
    settings = ArbiterSettings(alpha=0.3)
    config = RecordConfig(policy=("outputs/first/", "b"), arbiter="blend", arbitration=settings)
    said = json.loads(str(session_columns(config)["shared"]))
    assert said == {"arbiter": "blend", "policies": ["first", "b"]} | asdict(settings)
    assert "shared" not in session_columns(RecordConfig())


def test_a_policy_of_another_rate_or_scene_is_refused_by_the_flag_that_was_said(tmp_path):
    policy = untrained_act(tmp_path / "act", "intent")
    for flag, said, own in (
        ("--robot_fps", "40", "20"),
        ("--dataset.fps", "40", "20"),
        ("--moving_obstacles", "2", "0"),
    ):
        told = f"expected {flag} {own}, as it was trained, got {said}"
        refused(tmp_path / "set", *WORDS, "--policy", policy, flag, said, told=told)
