"""Laws: only a fresh input of a page that is seen moves the robot; after a brake all is let go first."""

import time
from dataclasses import replace

import numpy as np
import pytest

from handrail.collect.operators.modes import MODES
from handrail.collect.operators.operator import EpisodeEvent, View
from handrail.collect.operators.person import person
from handrail.collect.operators.person.inputs import Ask, Input
from handrail.collect.operators.person.person import Person, Phase
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import DEAD_MAN_TIME, Intent
from handrail.controllers.registry import fitting
from handrail.controllers.robot.model import load_model

MODEL = load_model()
CLOCK = [100.0]


@pytest.fixture
def operator():
    CLOCK[0] = 100.0
    made = Person(MODEL, fitting(MODES, 1), "ee", lambda: CLOCK[0])
    made.reset(view(), np.random.default_rng(0))
    return made


def view(time=0.0):
    q = np.array(MODEL.description.home)
    return View(State(q, np.zeros(MODEL.size), time), None)  # pyright: ignore[reportArgumentType]


def drive(operator, on=True, **axes):
    names = operator.meaning.channels.names
    values = tuple(float(axes.get(name.replace(".", "_"), 0.0)) for name in names)
    operator.take(Input(on, "keyboard", (False,), values, 0.0, ()), CLOCK[0], 0.01)


def begin(operator):
    operator.ask(Ask("start", True))
    drive(operator)
    assert isinstance(operator.act(view()), Intent)


def test_nothing_moves_before_start(operator):
    drive(operator, ee_vx=1.0)
    assert operator.act(view()) is EpisodeEvent.PAUSE
    assert operator.phase is Phase.READY


def test_a_key_moves_the_hand(operator):
    begin(operator)
    drive(operator, ee_vx=1.0)
    intent = operator.act(view(1.0))
    assert intent.mode == "ee"
    assert intent.time == 1.0
    assert np.array_equal(intent.mask, operator.meaning.channels.mask("ee"))
    assert intent.values[operator.meaning.channels.hand_slice()][0] == pytest.approx(0.6 * 0.35)
    assert intent.raw.values[3] == 1.0
    assert intent.raw.axes == 1


def test_a_key_that_was_held_before_start_does_not_move(operator):
    drive(operator, ee_vx=1.0)
    operator.ask(Ask("start", True))
    assert not operator.act(view()).values.any()
    drive(operator)
    drive(operator, ee_vx=1.0)
    assert operator.act(view()).values.any()


@pytest.mark.parametrize("trouble", ["old", "off", "gone"])
def test_doubtful_input_pauses_until_all_is_let_go(operator, trouble):
    begin(operator)
    drive(operator, ee_vx=1.0)
    assert isinstance(operator.act(view()), Intent)
    if trouble == "old":
        CLOCK[0] += DEAD_MAN_TIME + 0.01
    elif trouble == "off":
        drive(operator, on=False)
    else:
        operator.lose()
    assert operator.act(view()) is EpisodeEvent.PAUSE
    drive(operator, ee_vx=1.0)
    assert operator.act(view()) is EpisodeEvent.PAUSE
    drive(operator)
    again = operator.act(view())
    assert isinstance(again, Intent) == (trouble != "gone")  # a page that was gone has to press Start


@pytest.mark.parametrize("supervises", [False, True])
def test_after_a_sleep_of_the_computer_only_start_goes_on(supervises, monkeypatch):
    """All clocks stood still with it: the newest input is as new as before."""
    slept = [5.0]
    monkeypatch.setattr(person, "time_with_sleep", lambda: time.monotonic() + slept[0])
    made = Person(MODEL, fitting(MODES, 1), "ee", lambda: CLOCK[0], supervises)
    made.reset(view(), np.random.default_rng(0))
    begin(made)
    drive(made, ee_vx=1.0)
    assert isinstance(made.act(view()), Intent)
    slept[0] += 3600.0
    drive(made, ee_vx=1.0)
    assert made.act(view()) is EpisodeEvent.PAUSE
    drive(made)
    assert made.act(view()) is EpisodeEvent.PAUSE
    begin(made)


def test_the_stop_holds_until_it_is_released_and_start_is_pressed(operator):
    begin(operator)
    operator.ask(Ask("stop", True))
    for what in ("start", "pause"):
        operator.ask(Ask(what, True))
        drive(operator)
        assert operator.act(view()) is EpisodeEvent.PAUSE
        assert operator.phase is Phase.STOPPED
    operator.reset(view(), np.random.default_rng(0))
    assert operator.phase is Phase.STOPPED  # also in the next episode
    operator.ask(Ask("stop", False))
    assert operator.act(view()) is EpisodeEvent.PAUSE
    operator.ask(Ask("start", True))
    drive(operator)
    assert isinstance(operator.act(view()), Intent)


@pytest.mark.parametrize("event", ["success", "failure", "discard", "restart"])
def test_the_operator_ends_an_episode(operator, event):
    begin(operator)
    operator.ask(Ask(event, True))
    assert operator.act(view()) == EpisodeEvent(event)


@pytest.mark.parametrize("stops", [(), (True,), (True, False)], ids=["ready", "stopped", "released"])
@pytest.mark.parametrize("judged", ["success", "failure"])
def test_an_episode_that_has_not_begun_cannot_be_judged(operator, stops, judged):
    for pressed in stops:
        operator.ask(Ask("stop", pressed))
    operator.ask(Ask(judged, True))
    operator.ask(Ask("practice", True))  # can still be chosen
    drive(operator)
    assert operator.act(view()) is EpisodeEvent.PAUSE
    assert operator.practises
    operator.ask(Ask("stop", False))
    begin(operator)
    operator.ask(Ask("practice", False))
    assert operator.practises
    operator.ask(Ask("stop", True))
    operator.ask(Ask(judged, True))
    assert operator.act(view()) == EpisodeEvent(judged)


def test_choices_count_as_switches_where_they_change_what_is_owned(operator):
    begin(operator)
    for what, value in (("mode", "switching"), ("focus", "base"), ("frame", "tool"), ("speed", 1.0)):
        operator.ask(Ask(what, value))
    operator.ask(Ask("lock", (3,)))
    operator.ask(Ask("mode", "no such mode"))
    drive(operator, base_vx=1.0)
    intent = operator.act(view())
    channels = operator.meaning.channels
    assert intent.mode == "switching"
    assert intent.raw.switches == 3
    assert intent.values[0] == pytest.approx(0.5)
    assert intent.mask[channels.joint_slice.start + 3]
    assert intent.values[channels.joint_slice.start + 3] == 0.0
    assert intent.frames.tool == "tool"


def test_the_hand_moves_as_the_page_looks(operator):
    begin(operator)
    drive(operator, ee_vx=1.0)
    operator.inputs = replace(operator.inputs, view=np.pi / 2)
    tool = operator.act(view()).values[operator.meaning.channels.hand_slice()]
    assert tool[:3] == pytest.approx([0.0, 0.21, 0.0], abs=1e-9)


def test_the_base_is_driven_through_its_joints_where_these_are_owned(operator):
    operator.ask(Ask("mode", "direct"))
    begin(operator)
    turned = view()
    turned.state.q.flags.writeable = True
    turned.state.q[2] = np.pi / 2
    drive(operator, base_vx=1.0)
    joints = operator.act(turned).values[operator.meaning.channels.joint_slice]
    assert joints[:3] == pytest.approx([0.0, 0.3, 0.0], abs=1e-9)


def test_an_input_of_another_robot_is_not_taken(operator):
    begin(operator)
    operator.take(Input(True, "keyboard", (False,), (1.0,) * 3, 0.0, ()), CLOCK[0])
    assert not operator.act(view()).values.any()


def test_joints_go_to_their_targets_within_full_stick(operator):
    operator.ask(Ask("mode", "leader"))
    begin(operator)
    now = view()
    arm = np.array(now.state.q[3:])
    axes = (0.0,) * operator.meaning.channels.size
    targets = arm + np.array([0.01, 1.0, -1.0] + [0.0] * (len(arm) - 3))
    operator.take(Input(True, "sliders", (False,), axes, 0.0, tuple(targets)), CLOCK[0])
    intent = operator.act(now)
    joints = intent.values[operator.meaning.channels.joint_slice][3:]
    assert joints[0] == pytest.approx(0.06)
    assert joints[1] == -joints[2] > 0.06
    assert not joints[3:].any()
    assert intent.raw.values[-len(arm) :] == pytest.approx(targets)


def test_targets_count_only_after_they_were_let_go(operator):
    operator.ask(Ask("mode", "leader"))
    operator.ask(Ask("start", True))
    now = view()
    held = Input(True, "sliders", (False,), (0.0,) * operator.meaning.channels.size, 0.0, (1.0,) * 6)
    operator.take(held, CLOCK[0])
    assert not operator.act(now).values.any()
    operator.take(replace(held, targets=()), CLOCK[0])
    operator.take(held, CLOCK[0])
    assert operator.act(now).values.any()


def test_any_channels_can_be_owned(operator):
    begin(operator)
    operator.ask(Ask("mask", (0, 5, 99)))
    drive(operator, base_vx=1.0)
    intent = operator.act(view())
    assert np.flatnonzero(intent.mask).tolist() == [0, 5]
    assert intent.mode == "mask:100001" + "0" * (intent.mask.size - 6)
    assert intent.raw.switches == 1


def test_a_judged_episode_is_saved_before_the_recording_ends(operator):
    """However soon one word follows the other: no end overtakes a judgement."""
    begin(operator)
    for what in ("success", "quit"):
        operator.ask(Ask(what))
    assert operator.act(view()) is EpisodeEvent.SUCCESS
    operator.reset(view(), np.random.default_rng(0))
    assert operator.act(view()) is EpisodeEvent.QUIT
    operator.reset(view(), np.random.default_rng(0))
    assert operator.act(view()) is EpisodeEvent.PAUSE


def test_an_episode_that_runs_is_paused_before_it_is_quit(operator):
    begin(operator)
    operator.ask(Ask("quit"))
    assert operator.act(view()) is EpisodeEvent.PAUSE
    assert operator.phase is Phase.PAUSED
    operator.ask(Ask("quit"))
    assert operator.act(view()) is EpisodeEvent.QUIT


@pytest.mark.parametrize("supervises", [False, True])
@pytest.mark.parametrize("loss", ["late", "hidden"])
def test_a_supervisor_presses_start_after_a_loss(supervises, loss):
    """A policy would drive on by itself: that all is let go is how they supervise."""
    CLOCK[0] = 100.0
    operator = Person(MODEL, fitting(MODES, 1), "ee", lambda: CLOCK[0], supervises)
    operator.reset(view(), np.random.default_rng(0))
    begin(operator)
    if loss == "late":
        CLOCK[0] += DEAD_MAN_TIME + 0.01
    else:
        drive(operator, on=False)
    assert operator.act(view()) is EpisodeEvent.PAUSE
    for _ in range(3):
        drive(operator)
        went_on = operator.act(view()) is not EpisodeEvent.PAUSE
        assert went_on == (not supervises)
    operator.ask(Ask("start"))
    assert isinstance(operator.act(view()), Intent)
