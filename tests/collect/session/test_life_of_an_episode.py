"""What a person may say of an episode: done, gone wrong, throw away, begin again, wait. And being late."""

import os
import time
from dataclasses import replace

import numpy as np
import pytest
from collect_helpers import Watcher, recording

from handrail.collect.commands.record import record
from handrail.collect.config import DatasetConfig, RecordConfig, SessionConfig
from handrail.collect.operators.modes import MODES
from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.seeds import episode_seed
from handrail.collect.session import build
from handrail.collect.session.build import (
    build_controller,
    build_env,
    build_modes,
    build_session,
)
from handrail.collect.session.outcome import Tally
from handrail.collect.session.rehearsal import Rehearsal
from handrail.collect.session.session import Session
from handrail.controllers.baselines.direct import DirectController
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Status
from handrail.controllers.interface.intent import Intent
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.robot.model import load_model
from handrail.datasets.reading.reader import read_episodes, read_frames

SUCCESS, FAILURE, DISCARD, RESTART, QUIT, _, PAUSE = EpisodeEvent


class Person:
    """Drives the base, and says what is in `says` at these calls of an episode, episode by episode."""

    def __init__(self, model, *says):
        self._channels, self._says = Channels.of(model.description), iter(says)

    def reset(self, view, rng):
        self.asked, self.now = 0, next(self._says)

    def act(self, view):
        self.asked += 1
        if self.asked in self.now:
            return self.now[self.asked]
        values = np.zeros(self._channels.size)
        values[0] = 0.2
        return Intent(values, self._channels.mask("base"), time=view.state.time)


@pytest.fixture
def env():
    env = build_env(SessionConfig(task="reach", physics=False), 20)
    yield env
    env.close()


def run(env, says, controller=None, **options):
    person, watcher = Person(env.model, says), Watcher()
    controller = controller or DirectController(env.model, env.period)
    return Session(env, controller, person, [watcher], **options).run(3), watcher.frames, person


@pytest.mark.parametrize(
    ("event", "real", "success", "reason"),
    [
        (SUCCESS, False, False, "judge: not done"),
        (FAILURE, False, False, "operator: failure"),
        (SUCCESS, True, True, ""),
        (FAILURE, True, False, "operator: failure"),
    ],
)
def test_the_operator_ends_an_episode(env, monkeypatch, event, real, success, reason):
    """The frame in which they say so is the last one; the robot brakes in it, and rests in the end.

    The task's judge says what a success is; of a real robot nobody knows the truth, and the operator does.
    """
    monkeypatch.setattr(env, "real", real)
    outcome, frames, _ = run(env, {15: event})
    assert (outcome.success, outcome.failure_reason, outcome.ended_by) == (success, reason, event)
    assert outcome.operator_says == event
    assert outcome.kept
    assert [frame.done for frame in frames] == 14 * [False] + [True]
    assert [frame.success for frame in frames] == 14 * [False] + [success]
    assert not frames[-1].intent.mask.any()
    assert 0.0 < frames[-1].action[0] < frames[-2].action[0]
    assert not env.state().commanded.any()


@pytest.mark.parametrize("controller", [lambda model: DirectController(model, 0.05), MaskedMpc])
def test_a_pause_brakes_holds_and_goes_on(env, controller):
    """While the robot stands still nothing is recorded and no time passes; nothing jumps."""
    saying = dict.fromkeys(range(20, 120), PAUSE) | {140: SUCCESS}
    outcome, frames, person = run(env, saying, controller(env.model))
    sent = np.array([frame.action[:-1] for frame in frames])
    braking = [frame for frame in frames[:-1] if frame.diagnostics.status is Status.STALE_INTENT]
    assert 1 <= len(braking) < 40
    assert len(frames) == person.asked - (100 - len(braking)) == outcome.frames
    assert not sent[18 + len(braking)].any()
    assert sent[-2].any()
    steps = np.abs(np.diff(sent, axis=0, prepend=np.zeros((1, sent.shape[1]))))
    assert np.all(steps <= env.model.description.limits.acceleration * env.period * (1.0 + 1e-5))
    q = np.array([frame.state[: env.model.size] for frame in frames])
    assert np.abs(np.diff(q, axis=0)).max() < 0.02


@pytest.mark.parametrize("event", [DISCARD, RESTART, QUIT])
def test_an_episode_that_is_not_kept_is_over_at_once(env, event, tmp_path):
    with recording(tmp_path / "d", env) as recorder:
        writer, person = recorder.writer, Person(env.model, {9: event}, {5: SUCCESS})
        session = Session(env, DirectController(env.model, env.period), person, [recorder])
        outcome = session.run(3)
        assert (outcome.kept, outcome.ended_by, outcome.frames) == (False, event, 8)
        assert not env.state().commanded.any()
        recorder.end(outcome)
        assert (writer.num_episodes, writer.open_frames) == (0, 0)
        recorder.end(session.run(3))
    assert [row["length"] for row in read_episodes(tmp_path / "d")] == [5]


def test_an_undo_where_there_is_none_loses_no_episode(env, monkeypatch):
    """Of a robot that cannot go back: the task ends the episode in the period in which somebody asks."""
    whole, _, _ = run(env, {})
    last = whole.frames
    outcome, _, _ = run(env, {last: EpisodeEvent.UNDO})
    assert (outcome.frames, outcome.failure_reason) == (last, whole.failure_reason)
    assert outcome.kept


def test_a_dataset_of_before_goes_on_with_the_columns_that_it_has(env, tmp_path):
    """Its episodes do not say what the operator said; that is why it failed, in words."""
    old = {"success": True, "failure_reason": "", "seed": 3, "started": 0.0, "wall_time": 1.0}
    old |= dict.fromkeys(("brakes", "late", "undos", "contact_onsets", "contact_periods"), 0)
    with recording(tmp_path / "d", env) as recorder:
        person = Person(env.model, *2 * [{5: SUCCESS}])
        session = Session(env, DirectController(env.model, env.period), person, [recorder])
        session.run(3)
        recorder.writer.save_episode(old)
        recorder.end(session.run(3))
    rows = read_episodes(tmp_path / "d")
    assert [row["failure_reason"] for row in rows] == ["", "judge: not done"]
    assert "operator_says" not in rows[-1]


def test_a_recording_counts_and_names_what_it_does_not_keep(tmp_path, monkeypatch, capsys):
    """After one thrown away comes another scene, after one begun again the same; both are said."""
    says = {6: DISCARD}, {7: RESTART}, {8: FAILURE}, {9: SUCCESS}
    monkeypatch.setattr(build, "build_operator", lambda config, mode, model: Person(model, *says))
    root = tmp_path / "d"
    config = RecordConfig(
        task="reach", mode="base", physics=False, dataset=DatasetConfig(root=str(root), num_episodes=2)
    )
    assert record(config) == 0
    rows = read_episodes(root)
    assert [row["length"] for row in rows] == [8, 9]
    assert [row["success"] for row in rows] == [False, False]
    assert [row["operator_says"] for row in rows] == ["failure", "success"]
    assert [row["failure_reason"] for row in rows] == ["operator: failure", "judge: not done"]
    first, other = (episode_seed(0, 0, attempt) for attempt in (0, 1))
    assert [row["seed"] for row in rows] == [other, episode_seed(0, 1)]
    said = capsys.readouterr().err
    assert f"not saved: thrown away, seed {first}\nnot saved: begun again, seed {other}\n" in said
    assert "0/2 succeeded, 1 thrown away, 1 begun again" in said
    done = read_frames(root, 0, ["next.done", "next.success"])
    assert done["next.done"].tolist() == 7 * [False] + [True]


def test_a_first_attempt_has_the_seed_that_it_always_had():
    for seed, episode in ((0, 0), (7, 3), (900, 2)):
        assert episode_seed(seed, episode) == int(
            np.random.SeedSequence([seed, episode]).generate_state(1)[0]
        )
        assert len({episode_seed(seed, episode, attempt) for attempt in range(50)}) == 50


@pytest.fixture
def now(monkeypatch):
    """A clock that goes on only in sleep."""
    now = [0.0]
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    monkeypatch.setattr(time, "sleep", lambda seconds: now.__setitem__(0, now[0] + seconds))
    return now


def test_a_pause_does_not_make_the_loop_late(env, now):
    """The clock of the pace stands for all periods, held ones too."""
    outcome, _, person = run(env, dict.fromkeys(range(5, 60), PAUSE) | {70: SUCCESS}, realtime=True)
    assert outcome.late == 0
    assert outcome.wall_time == pytest.approx(person.asked * env.period)
    assert outcome.wall_time > outcome.seconds + 1.0


def test_a_halt_is_not_caught_up_in_a_rush(now):
    """After a long period the beat begins anew: no two periods are shorter than they are."""
    begun, tally = [], Tally(0, 0.05)
    for number in range(20):
        begun.append(now[0])
        now[0] += 3.0 if number == 7 else 0.01
        tally.pace()
    lasted = np.diff(begun)
    assert np.allclose(np.delete(lasted, 7), 0.05)
    assert tally.outcome({"is_success": True, "failure_reason": ""}, None).late == 1


@pytest.mark.parametrize("realtime", [True, False])
def test_other_programs_wait_for_a_loop_in_real_time_until_it_ends(env, monkeypatch, realtime):
    """However it ends; threads that it begins do not come first."""
    said = []
    monkeypatch.setattr(os, "sched_setscheduler", lambda *words: said.append(words[:2]))
    monkeypatch.setattr(os, "sched_getscheduler", lambda process: os.SCHED_OTHER)

    class Failing(Rehearsal):
        def act(self, view):
            assert len(said) == realtime
            raise HandrailError("it fails")

    session = Session(
        env, DirectController(env.model, env.period), Failing(env.model, MODES), realtime=realtime
    )
    with pytest.raises(HandrailError, match="it fails"):
        session.run(3)
    policies = [os.SCHED_RR, os.SCHED_OTHER] if realtime else []
    assert said == [(0, policy | os.SCHED_RESET_ON_FORK) for policy in policies]


def test_a_warm_up_tries_every_mode_and_leaves_no_trace(env):
    """What a person may do, its controllers have done once; nobody watches, and nothing is paced."""
    modes = build_modes(SessionConfig(task="reach", physics=False), env)
    asked = []

    class Watched(DirectController):
        def update(self, state, intent):
            asked.append((intent.mode, tuple(np.flatnonzero(intent.mask))))
            return super().update(state, intent)

    controller = Watched(env.model, env.period)
    outcome = Session(env, controller, Rehearsal(env.model, modes), undoes=True).run(3)
    assert {mode for mode, _ in asked} == set(modes)
    assert len({mask for mode, mask in asked if mode == "switching"}) == 2  # hand and base
    assert outcome.undos == 1
    assert not env.state().commanded.any()


def test_three_rates(env):
    """The robot is sent a command a step, also between two updates; frames are rarer still."""
    updates, inner = [], MaskedMpc(env.model)
    honest = inner.update

    def update(state, intent):
        updates.append(state.time)
        return honest(state, intent)

    inner.update = update
    sent, step = [], env.step

    def stepped(action):
        result = step(action)
        sent.append(result[-1]["sent"])
        return result

    env.step = stepped
    outcome, frames, _ = run(env, {48: SUCCESS}, inner, control_period=0.1, record_period=0.2)
    assert (outcome.frames, len(updates), len(frames)) == (48, 24, 12)
    np.testing.assert_allclose(updates, 0.1 * np.arange(24), atol=1e-9)
    np.testing.assert_array_equal([frame.action for frame in frames], sent[3::4])
    assert np.all(np.diff([v[0] for v in sent[:8]]) > 0.0)  # also between two updates


def test_a_loop_slower_than_what_is_certified_is_refused():
    with pytest.raises(HandrailError, match=r"control rate .* 5: expected at least 10 Hz"):
        build_controller(MODES.find("ee"), load_model(), 5.0)
    assert build_controller(MODES.find("direct"), load_model(), 5.0)


def test_updates_that_take_longer_than_the_period_are_told(caplog, monkeypatch):
    update = MaskedMpc.update
    config = SessionConfig(task="reach", mode="ee", realtime=True, time_limit=0.3)
    env = build_env(config, 20)
    for seconds in (0.0, 0.2):

        def taking(self, state, intent, seconds=seconds):
            command = update(self, state, intent)
            return replace(command, diagnostics=replace(command.diagnostics, solve_time=seconds))

        monkeypatch.setattr(MaskedMpc, "update", taking)
        caplog.clear()
        build_session(config, env).run(1)
        assert ("took longer than the period of 50 ms" in caplog.text) is bool(seconds)
