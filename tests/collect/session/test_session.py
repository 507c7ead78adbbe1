"""The session's laws: episodes succeed without contact, repeat bit for bit, and replay."""

import numpy as np
import pytest
from collect_helpers import Watcher, episode, write_small_robot

from handrail.collect.config import SessionConfig
from handrail.collect.operators.modes import MODES
from handrail.collect.session.build import (
    build_controller,
    build_env,
    build_mode,
    build_operator,
    build_session,
)
from handrail.collect.session.session import Session
from handrail.controllers.baselines.cbf_filter import CbfFilter
from handrail.controllers.baselines.direct import DirectController
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.command import Status
from handrail.controllers.interface.intent import Intent
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.mpc.safety_filter import safety_filter
from handrail.controllers.registry import fitting


def run(seed=3, **settings):
    watcher = Watcher()
    return episode(seed, watcher, **settings), watcher.frames


@pytest.mark.parametrize("mode", sorted({*fitting(MODES, 1)} - {"base"}))
def test_every_mode_reaches(mode):
    """All but base driving, which cannot turn the hand."""
    if mode == "ee_mink":
        pytest.importorskip("mink")
    limit = (
        60.0 if mode in ("direct_single", "direct_erring") else 0.0
    )  # one axis at a time takes longer than the task gives
    outcome, moments = run(task="reach", mode=mode, seed=2, time_limit=limit)
    assert outcome.success, outcome
    assert MODES[mode].controller in ("direct", "dls", "dls_base", "split") or outcome.contact_onsets == 0
    assert all(frame.intent.mode == mode for frame in moments)


def test_base_mode_moves_the_base_alone():
    outcome, moments = run(task="reach", mode="base", seed=1)
    moved = np.abs(moments[-1].state[:9] - moments[0].state[:9])
    assert moved[:2].max() > 0.1
    assert moved[3:].max() < 0.3  # the arm only keeps clear
    assert outcome.contact_onsets == 0


class Unruly:
    """An operator whose commands are garbage now and then."""

    def __init__(self, channels):
        self._channels = channels
        self._asked = 0

    def reset(self, view, rng):
        self._rng = rng

    def act(self, view):
        self._asked += 1
        size = self._channels.size
        values = self._rng.uniform(-1, 1, size)
        if self._asked % 5 == 0:
            values[:] = self._rng.choice([np.nan, np.inf, 1e12])
        if self._asked % 7 == 0:
            return Intent(np.zeros(3), np.zeros(3, dtype=bool), time=view.state.time)
        late = 1.0 if self._asked % 11 == 0 else 0.0
        return Intent(values, self._channels.mask("ee"), time=view.state.time - late)


@pytest.mark.parametrize("kind", [MaskedMpc, DirectController, CbfFilter, safety_filter])
def test_garbage_brakes_and_is_counted(kind):
    env = build_env(SessionConfig(task="reach"), 20)
    controller = kind(env.model)
    watcher = Watcher()
    outcome = Session(env, controller, Unruly(controller.channels), [watcher]).run(0)
    statuses = [frame.diagnostics.status for frame in watcher.frames]
    assert outcome.brakes == sum(status.brakes for status in statuses) > 0
    assert {Status.INVALID_INTENT, Status.STALE_INTENT} <= set(statuses)
    assert all(np.all(np.isfinite(frame.action)) for frame in watcher.frames)
    actions = np.array([frame.action[:9] for frame in watcher.frames])
    limits = env.model.description.limits
    assert np.all(np.abs(np.diff(actions, axis=0)) <= limits.acceleration / 20 * 1.001 + 1e-5)


def test_a_mask_of_ones_own():
    env = build_env(SessionConfig(task="reach"), 20)
    mask = "000111000000000000"
    mode = build_mode(SessionConfig(task="reach", mask=mask), env.model)
    session = build_session(SessionConfig(task="reach", mask=mask), env, [watcher := Watcher()])
    session.run(0)
    assert mode.groups("hand") == ("ee.vx", "ee.vy", "ee.vz")
    assert {"".join(map(str, frame.intent.mask.astype(int))) for frame in watcher.frames} == {mask}
    with pytest.raises(HandrailError, match="expected 18 characters 0 or 1"):
        build_mode(SessionConfig(mask="0101"), env.model)


def test_a_second_robot_is_a_new_description_and_nothing_else(tmp_path):
    """A UR5 on a smaller base goes through controller, operator and session."""
    path = write_small_robot(tmp_path)
    env = build_env(SessionConfig(task="reach", robot=str(path)), 20)
    outcome = build_session(SessionConfig(task="reach", robot=str(path)), env, [watcher := Watcher()]).run(2)
    assert outcome.brakes == 0
    assert outcome.contact_onsets == 0
    goal = watcher.frames[0].environment[:3]
    tool = [list(env.agent_names).index(f"tool.{axis}") for axis in "xyz"]
    start, end = (np.linalg.norm(watcher.frames[k].state[tool] - goal) for k in (0, -1))
    assert end < 0.5 * start


class Grip:
    """Holds the robot fast for two seconds, whatever its servos do; a disturbance."""

    def begin(self, env, seed):
        self._simulation = env.simulation
        self._free = env.simulation.mujoco_model.dof_damping.copy()

    def act(self):
        held = 2.0 <= self._simulation.data.time < 4.0
        self._simulation.mujoco_model.dof_damping[:] = 1e9 if held else self._free


@pytest.mark.parametrize("mode", ["ee", "direct"])
def test_the_recorded_command_is_the_sent_one(mode):
    """Also of a robot that is held fast: consecutive actions keep the limits; the controller knows them."""
    watcher, config = Watcher(), SessionConfig(task="reach", mode=mode)
    env = build_env(config, 20)
    chosen = build_mode(config, env.model)
    operator = build_operator(config, chosen, env.model)
    controller = build_controller(chosen, env.model, env.fps, config.task)
    session = Session(env, controller, operator, [watcher], disturbances=[Grip()])
    sent = []
    step = env.step

    def stepped(action):
        result = step(action)
        sent.append(np.append(env.state().commanded, result[4]["sent"][-1]))
        return result

    env.step = stepped
    session.run(3)
    actions = np.array([frame.action for frame in watcher.frames])
    commands = np.array([frame.command for frame in watcher.frames])
    np.testing.assert_array_equal(actions, sent)
    limits = env.model.description.limits
    steps = np.abs(np.diff(actions[:, :-1], axis=0, prepend=np.zeros((1, env.model.size))))
    assert np.all(steps <= limits.acceleration / env.fps * (1.0 + 1e-5))
    if mode == "ee":
        speeds = np.abs(actions[:, :-1] / limits.velocity).max(axis=1)
        assert speeds[60:80].max() < 0.5 * speeds[:40].max()  # held: the command waits
        np.testing.assert_allclose(actions, commands, atol=1e-6)  # and nothing is cut behind its back
