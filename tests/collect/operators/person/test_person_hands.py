"""Laws of a person who steers a robot with two hands: one input for both, and any doubt brakes both."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from collect_helpers import Watcher

from handrail.collect.config import SessionConfig
from handrail.collect.operators.modes import MODES
from handrail.collect.operators.operator import EpisodeEvent, View
from handrail.collect.operators.person.inputs import Ask, Input
from handrail.collect.operators.person.meaning import Setting
from handrail.collect.operators.person.person import Person
from handrail.collect.session.build import build_controller, build_env, build_modes, build_session
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import DEAD_MAN_TIME, Intent
from handrail.controllers.registry import fitting
from handrail.controllers.robot.model import load_model

PERIOD = 0.05  # [s]
MODEL = load_model("tiago_pro")
CLOCK = [100.0]


def view(time=0.0, angle=0.0):
    q = np.array(MODEL.description.home)
    q[2] = angle
    return View(State(q, np.zeros(MODEL.size), time), None)  # pyright: ignore[reportArgumentType]


class Steering:
    """A person at a page of whom a test says where the inputs are."""

    def __init__(self, mode="ee"):
        self.person = Person(MODEL, fitting(MODES, 2), mode, lambda: CLOCK[0])
        self.names = self.person.meaning.channels.names
        self.person.reset(view(), np.random.default_rng(0))
        self.person.ask(Ask("start"))
        self.drive()
        assert isinstance(self.act(), Intent)

    def drive(self, grips=(False, False), **axes):
        axes = {name.replace("_", ".", 1): float(value) for name, value in axes.items()}
        values = tuple(axes.get(name, 0.0) for name in self.names)
        self.person.take(Input(True, "keyboard", grips, values, 0.0, ()), CLOCK[0])

    def act(self, now=None) -> Any:
        return self.person.act(now or view())

    def moved(self):
        intent = self.act()
        return {self.names[n] for n in np.flatnonzero(intent.values)}


def test_only_the_active_hand_moves_and_the_recording_says_which():
    steering = Steering()
    for switches, hand in enumerate(("left", "right", "left")):
        steering.person.ask(Ask("hand", hand))
        steering.drive(left_vx=1, right_vx=1)
        intent = steering.act()
        assert steering.moved() == {f"{hand}.vx"}
        assert np.array_equal(intent.mask, steering.person.meaning.channels.mask(hand))
        assert intent.raw.switches == switches


def test_a_mode_of_channels_that_a_robot_lacks_is_no_choice():
    """Two SO-101 arms share no torso: the mode that owns it would end the episode of who chose it."""
    modes = build_modes(SessionConfig(), build_env(SessionConfig(robot="bi_so101"), 20))
    assert {"both", "pair"} < modes.keys()
    assert "hand+torso" not in modes
    assert "hand+torso" in build_modes(SessionConfig(), build_env(SessionConfig(robot="tiago_pro"), 20))


def test_a_hand_that_there_is_not_changes_nothing():
    steering = Steering()
    before = steering.person.setting
    for value in ("third", "", "ee", "left"):
        steering.person.ask(Ask("hand", value))
    assert steering.person.setting == before


def test_each_gripper_is_asked_for_itself():
    steering = Steering()
    for grips in ((True, False), (False, True), (True, True)):
        steering.drive(grips)
        assert steering.act().grippers == tuple(map(float, grips))


def test_a_page_that_comes_in_another_state_changes_no_gripper():
    """One that was loaded anew, or another one that drives now: only what it changes itself counts."""
    steering = Steering()
    steering.drive((True, False))
    steering.person.lose()
    steering.drive((False, False))
    steering.person.ask(Ask("start"))
    assert steering.act().grippers == (1.0, 0.0)
    steering.drive((True, False))
    assert steering.act().grippers == (0.0, 0.0)


@pytest.mark.parametrize("grips", [(), (True,), (True, True, True)])
def test_an_input_for_another_number_of_hands_is_not_taken(grips):
    steering = Steering()
    steering.drive(grips, left_vx=1)
    assert not steering.moved()
    assert steering.act().grippers == (0.0, 0.0)


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("trouble", ["old", "off", "gone"])
def test_doubtful_input_brakes_both_until_all_is_let_go(side, trouble):
    steering = Steering()
    person = steering.person
    person.ask(Ask("mask", tuple(np.flatnonzero(person.meaning.channels.mask("left", "right")).tolist())))
    both = {f"{hand}_vx": 1.0 for hand in ("left", "right")}
    steering.drive(**both)
    assert steering.moved() == {"left.vx", "right.vx"}
    if trouble == "old":
        CLOCK[0] += DEAD_MAN_TIME + 0.01
    elif trouble == "off":
        person.inputs = replace(person.inputs, on=False)
    else:
        person.lose()
    assert steering.act() is EpisodeEvent.PAUSE
    steering.drive(**{f"{side}_vx": 1.0})  # one hand's were let go, not the other's
    assert steering.act() is EpisodeEvent.PAUSE


def test_every_twist_is_turned_as_the_person_looks():
    steering, channels = Steering(), Steering().person.meaning.channels
    person = steering.person
    person.ask(Ask("mask", tuple(np.flatnonzero(channels.mask("ee", "pair")).tolist())))
    person.ask(Ask("frame", "base"))
    steering.drive(left_vx=1, right_vy=1, pair_vx=1)
    values = steering.act(view(angle=np.pi / 2)).values
    for name, (x, y) in {"left": (0, 1), "right": (-1, 0), "pair": (0, 1)}.items():
        found = [values[channels.names.index(f"{name}.{axis}")] for axis in ("vx", "vy")]
        assert np.sign(np.round(found, 9)).tolist() == [x, y]


class Switching:
    """A person who holds a key and goes to the other hand again and again."""

    def __init__(self, env, mode):
        self.person, self._steps = Person(env.model, fitting(MODES, 2), mode, lambda: 0.0), 0

    def reset(self, view, rng):
        self.person.reset(view, rng)
        self.person.ask(Ask("start"))
        self.take(0.0)

    def take(self, share):
        axes = [share] * self.person.meaning.channels.size
        self.person.take(Input(True, "keyboard", (False, False), tuple(axes), 0.0, ()), 0.0)

    def act(self, view):
        self._steps += 1
        if self._steps % 8 == 0:
            self.person.ask(Ask("hand", ("right", "left")[self._steps // 8 % 2]))
        self.take(float(self._steps > 1))
        return self.person.act(view) if self._steps < 64 else EpisodeEvent.FAILURE


@pytest.mark.parametrize("mode", ["ee", "ee_dls"])
def test_the_other_hand_takes_over_without_a_jolt(mode):
    """What is sent stays within the limits of acceleration; both hands move, and nothing brakes."""
    config = SessionConfig(task="reach", mode=mode, robot="tiago_pro", physics=False)
    env = build_env(config, 20)
    session = build_session(config, env, (watcher := Watcher(),), person=Switching(env, mode))
    replace(session, realtime=False).run(0)
    sent = np.array([frame.action[:-2] for frame in watcher.frames])
    limits = MODEL.description.limits
    assert np.all(np.abs(np.diff(sent, axis=0, prepend=0.0)) <= PERIOD * limits.acceleration * 1.0001)
    steered = [frame for frame in watcher.frames if frame.intent.mask.any()]
    assert len({frame.intent.mask.tobytes() for frame in steered}) == 2
    assert not any(frame.diagnostics.status.brakes for frame in steered)
    for hand in range(2):
        assert np.abs(sent[:, env.model.with_hand(("left", "right")[hand]).moving]).max() > 0.05


def test_a_pair_parts_while_that_is_moved_and_stays_as_it_was_left():
    """What keeps hands together rests while they part; then it keeps where they are, not where they were."""
    config = SessionConfig(task="reach", mode="pair", robot="tiago_pro", physics=False)
    env, meaning = build_env(config, 20), Steering("pair").person.meaning
    env.reset(seed=0)
    controller = build_controller(MODES["pair"], env.model, 20)
    controller.reset(env.obstacles())
    apart = meaning.channels.names.index("apart.v")

    def between():
        one, other = env.plant.tools
        return other.rotation.T @ (one.position - other.position)

    def steer(periods, share):
        for _ in range(periods):
            axes = np.where(np.arange(meaning.channels.size) == apart, share, 0.0)
            inputs = Input(True, "keyboard", (False, False), tuple(axes), 0.0, ())
            intent = meaning.intent(inputs, Setting(MODES["pair"]), env.state())
            assert intent.mask[apart] == bool(share)
            env.plant.send(np.append(controller.update(env.state(), intent).velocity(PERIOD), [0.0, 0.0]))
        return between()

    before, parted = steer(2, 0.0), steer(10, 0.5)
    assert np.linalg.norm(parted) > np.linalg.norm(before) + 0.03
    left = steer(10, 0.0)
    assert np.linalg.norm(left) > np.linalg.norm(parted) - 0.005
    np.testing.assert_allclose(steer(10, 0.0), left, atol=0.005)
