"""A gripper stays as it is until a person changes it; a twist is recorded along the world's axes."""

from dataclasses import replace

import numpy as np
import pytest
from arbiter_helpers import Fake, arbiter, asks
from collect_helpers import Watcher

from handrail.collect.config import SessionConfig
from handrail.collect.operators.person.inputs import Ask, Input
from handrail.collect.operators.person.person import Person
from handrail.collect.operators.shared.shared_operator import SharedOperator
from handrail.collect.session.build import build_env, build_modes, build_session
from handrail.controllers.interface.channels import Channels
from handrail.datasets.recording.frames import frame_row

GRIP, REST, MOVE, UP = "grip", "rest", "ee.vx", "ee.vz"


class Page:
    """A person at a page who does what a plan says; a policy beside them keeps its gripper."""

    def __init__(self, env, config, plan, shared, closed=False, frame="world"):
        self.person = Person(env.model, build_modes(config, env), "ee", lambda: 0.0)
        self.person.ask(Ask("frame", frame))
        policy = Fake(asks("base", value=0.0, grippers=(float(closed),)))
        both = SharedOperator(self.person, policy, arbiter("by_mask"), env.model)
        self._operator, self._plan, self._grips = both if shared else self.person, plan, False
        self._names = Channels.of(env.model.description).names

    def reset(self, view, rng):
        self._left = iter(self._plan)
        self._operator.reset(view, rng)
        self.person.ask(Ask("start"))

    def act(self, view):
        what = next(self._left)
        if what in ("pause", "undo", "start", "failure"):
            self.person.ask(Ask(what))
        self._grips ^= what == GRIP
        axes = tuple(float(name == what) for name in self._names)
        self.person.take(Input(True, "keyboard", (self._grips,), axes, 0.0, ()), 0.0)
        return self._operator.act(view)


def driven(task, plan, shared=False, **asked):
    """Return the frames of an episode, and how it went."""
    config, watcher = SessionConfig(task=task), Watcher()
    env = build_env(config, 20)
    page = Page(env, config, [*plan, "failure", REST], shared, **asked)
    session = replace(build_session(config, env, (watcher,), person=page), realtime=False)
    outcome = session.run(1)
    return watcher.frames, outcome


@pytest.mark.parametrize("shared", [False, True])
def test_an_object_held_at_the_beginning_stays_in_the_hand(shared):
    frames, outcome = driven("tray", [UP] * 20, shared, closed=True)
    assert {frame.action[-1] for frame in frames} == {1.0}
    assert outcome.failure_reason != "tray_dropped"
    frames, outcome = driven("tray", [UP, GRIP, *[UP] * 30], shared, closed=True)
    assert outcome.failure_reason == "tray_dropped"


@pytest.mark.parametrize("shared", [False, True])
@pytest.mark.parametrize("closed", [False, True])
def test_an_undo_takes_back_what_a_gripper_did(shared, closed):
    before, pause = [REST, *[GRIP] * (closed and not shared), *[REST] * 9], ["pause", *[REST] * 30]
    again = [GRIP, *[MOVE] * 10, "undo", "start", *[REST] * 3, *[MOVE] * 10]
    frames, _ = driven("pick_place", [*before, *pause, "start", REST, *again], shared, closed=closed)
    assert {frame.action[-1] for frame in frames[-10:]} == {float(closed)}
    changed = [frame.action[-1] for frame in frames if frame.undos == 0]
    assert changed[-1] == (0.0 if closed else 1.0)


@pytest.mark.parametrize("frame", ["world", "base", "tool"])
def test_intents_are_recorded_along_the_world_s_axes_in_every_frame(frame):
    """As policies of intents take it."""
    config = SessionConfig(task="reach")
    env = build_env(config, 20)
    frames, _ = driven("reach", [REST, *[UP] * 20], frame=frame)
    place = [env.agent_names.index(f"tool.{axis}") for axis in "xyz"]
    moved = (frames[-2].state - frames[-12].state)[place]
    twist = Channels.of(env.model.description).hand_slice()
    recorded = frame_row(frames[-8])["teleop.values"][twist][:3]
    assert recorded @ moved / np.linalg.norm(recorded) / np.linalg.norm(moved) > 0.95
    assert (abs(recorded[2]) > 0.1) == (frame != "tool"), "the tool looks ahead"
