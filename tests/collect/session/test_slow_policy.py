"""Laws of a policy that thinks long beside the loop: nobody waits for it; without a plan the robot brakes.

A gate opens when the test says so, so that an answer takes as long as the test wants, in the robot's time.
"""

import threading
import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from handrail.collect.config import SessionConfig
from handrail.collect.operators.modes import MODES
from handrail.collect.operators.shared.arbiter import Groups
from handrail.collect.operators.shared.by_input import ByMask
from handrail.collect.operators.shared.planning import ThreadedPlanner
from handrail.collect.operators.shared.settings import ArbiterSettings
from handrail.collect.operators.shared.shared_operator import SharedOperator
from handrail.collect.session.build import build_controller, build_env
from handrail.collect.session.loop import EpisodeLoop
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Status
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.sources import PERSON, POLICY

LATE = 10  # periods until an answer: 0.5 s
PERIOD = 0.05  # [s]


class Gated:
    """Plans a twist of the hand, as soon as the gate is open for an answer."""

    doubt = 0.0

    def __init__(self, channels, rows):
        self.gate, self.answered = threading.Semaphore(0), threading.Semaphore(0)
        self._rows, self._channels = rows, channels

    def reset(self, view, rng):
        pass

    def replan(self):
        pass

    def act(self, view):
        self.gate.acquire(timeout=60.0)
        values = np.where(self._channels.mask("ee.vz"), 0.1, 0.0)
        self._now = Intent(values, self._channels.mask("ee"), mode="ee", time=view.state.time)
        return self._now

    def chunk(self):
        planned = [replace(self._now, time=self._now.time + n * PERIOD) for n in range(1, self._rows)]
        self.answered.release()
        return planned


class Hand:
    """A person whose stick is where the test put it."""

    def __init__(self, channels):
        self.speed, self.channel, self._channels = 0.0, "ee.vy", channels

    def reset(self, view, rng):
        pass

    def act(self, view):
        values = np.where(self._channels.mask(self.channel), self.speed, 0.0)
        return Intent(values, self._channels.mask("base", "ee"), mode="ee", time=view.state.time)


class Episode:
    """One in which a person supervises a slow policy."""

    def __init__(self, env, rows):
        channels = Channels.of(env.model.description)
        self.slow, self.hand = Gated(channels, rows), Hand(channels)
        self._loop = EpisodeLoop(env, build_controller(MODES["ee"], env.model, 20))
        arbiter = ByMask(Groups(channels), ArbiterSettings())
        self._operator = SharedOperator(self.hand, ThreadedPlanner(self.slow, PERIOD), arbiter, env.model)
        self._operator.reset(self._loop.begin(0), np.random.default_rng(0))

    def step(self):
        """Step; return the frame and the channels that each has."""
        asked: Any = self._operator.act(self._loop.look())
        frame = self._loop.step(asked)
        sources = {each.name: each for each in asked.sources}
        return frame, {name for name in sources if np.any(sources[name].share())}

    def until_policy(self):
        """Open the gate for one answer; step as soon as it is there, in the robot's time."""
        self.step()  # so that it has been asked
        self.slow.gate.release()
        assert self.slow.answered.acquire(timeout=60.0)
        for _ in range(100):
            frame, drivers = self.step()
            if POLICY in drivers:
                return frame
            time.sleep(0.05)  # for the thread to hand it over
        raise AssertionError("no answer")


@pytest.fixture(scope="module")
def env():
    made = build_env(SessionConfig(task="reach", physics=False, time_limit=600.0), 20)
    yield made
    made.close()


@pytest.fixture
def episode(env):
    made = []

    def begun(rows):
        made.append(Episode(env, rows))
        return made[-1]

    yield begun
    for each in made:
        each.slow.gate.release(1000)


def test_the_loop_goes_on_and_the_robot_brakes_until_there_is_a_plan(episode):
    late = episode(5000)
    for number in range(LATE):
        frame, drivers = late.step()
        assert frame.number == number
        assert not drivers
        assert frame.diagnostics.status is Status.STALE_INTENT
        assert not np.any(frame.action[:-1])
    frame = late.until_policy()
    assert frame.intent.source(POLICY).intent.raw.age >= LATE * PERIOD - 1e-9
    for _ in range(LATE):
        frame, _ = late.step()
    assert np.any(np.abs(frame.action[:-1]) > 0.01)


def test_the_person_drives_while_the_policy_thinks(episode):
    late = episode(5000)
    late.hand.speed = 0.1
    for _ in range(LATE):
        frame, drivers = late.step()
        assert drivers == {PERSON}
        assert frame.diagnostics.status is Status.OK
    assert np.any(np.abs(frame.action[:-1]) > 0.01)


def test_after_the_last_period_of_its_plan_the_robot_brakes(episode):
    """The next answer does not come: the robot comes to rest, period by period, and stays there."""
    rows = 400
    late = episode(rows)
    frame = late.until_policy()
    begun = frame.intent.source(POLICY).intent.raw.age
    left = rows - round(begun / PERIOD)
    for _ in range(left - 1):
        frame, drivers = late.step()
        assert drivers == {POLICY}
    frames = [late.step()[0] for _ in range(40)]
    assert frames[-1].number == frame.number + 40
    assert all(each.diagnostics.status is Status.STALE_INTENT for each in frames[10:])
    np.testing.assert_allclose(frames[-1].action[:-1], 0.0, atol=1e-6)


def test_the_person_drives_on_after_the_last_period_of_its_plan(episode):
    """They move the base; the hand, which was the policy's, is nobody's then."""
    late = episode(200)
    late.until_policy()
    late.hand.channel, late.hand.speed = "base.vx", 0.1
    assert late.step()[1] == {PERSON, POLICY}
    for _ in range(220):
        frame, drivers = late.step()
        assert frame.diagnostics.status is Status.OK
    assert drivers == {PERSON}
    assert frame.intent.source(POLICY) is None
    assert np.any(np.abs(frame.action[:-1]) > 0.01)
