"""Laws: STOP gets through whatever is queued before it, and nothing that takes motion away is dropped."""

import asyncio
import json
import os
import signal
import time
from concurrent.futures import ThreadPoolExecutor

import msgspec
import numpy as np
import pytest
from cockpit_helpers import ask_for, drive, page, seen, server, show, stage, told

from handrail.collect.cockpit.hub import Hub
from handrail.collect.cockpit.pipe import Kind
from handrail.collect.operators.modes import MODES
from handrail.collect.operators.operator import EpisodeEvent, View
from handrail.collect.operators.person.inputs import STILLS, Ask, Input
from handrail.collect.operators.person.person import Person, Phase
from handrail.controllers.interface.controller import State
from handrail.controllers.registry import fitting
from handrail.controllers.robot.model import load_model

HELD = [1.0] * 18
BURST = 600  # messages


class QueuedSocket:
    """A page's socket as the web server has it: messages that have come, and then nothing."""

    def __init__(self, messages):
        self.left, self.said, self.closed = list(messages), [], None

    async def accept(self):
        pass

    async def receive(self):
        if not self.left:
            return {"type": "websocket.disconnect"}
        return {"type": "websocket.receive", "text": self.left.pop(0)}

    async def send_text(self, text):
        self.said.append(json.loads(text))

    async def close(self, code=1000):
        self.closed = code


@pytest.fixture
def hub(ends):
    recording, web = ends
    recording.send(Kind.STAGE, {})
    made = Hub(web)
    made.hear()
    return made


def serve(hub, *pages):
    """Let pages say what they have queued, all at the same time."""
    names = [f"page-number-{number}" for number in range(len(pages))]

    async def all_of_them():
        await asyncio.gather(*(hub.serve(each, name) for each, name in zip(pages, names, strict=True)))

    run(all_of_them())


def run(coroutine):
    """Run it in a thread of its own: a browser that is open has a loop in this one."""
    with ThreadPoolExecutor(1) as pool:
        pool.submit(asyncio.run, coroutine).result()


class Robot:
    """A person's side of the recording, 20 times a second, without a robot."""

    def __init__(self, recording):
        self._pipe, self._now = recording, time.monotonic()
        model = load_model()
        self.person = Person(model, fitting(MODES, 1), "ee", lambda: self._now)
        q = np.array(model.description.home)
        self._view = View(State(q, np.zeros(model.size), 0.0), None)
        self.person.reset(self._view, np.random.default_rng(0))
        self.person.ask(Ask("start"))

    @property
    def deflection(self):
        """Of the newest input that has come."""
        return self.person.inputs.axes[0] if self.person.inputs else 0.0

    def moves(self):
        """Obey what has come; return whether the robot is asked to move."""
        for kind, data in self._pipe.receive():
            if kind == Kind.STOP:
                self.person.ask(Ask("stop"))
            elif kind == Kind.LOST:
                self.person.lose()
            elif kind == Kind.DRIVE:
                inputs, self._now, _ = data
                self.person.take(msgspec.convert(inputs, Input), self._now)
            elif kind in (Kind.ASK, Kind.STILL):
                self.person.ask(Ask(**data))
        answer = self.person.act(self._view)
        return not isinstance(answer, EpisodeEvent) and bool(answer.values.any())


def stalled(recording, seconds=5.0, rate=40.0):
    """Return what a page has said while the web server stood still; the recording went on all the time."""
    now = time.monotonic()
    for moment in np.arange(now - seconds, now, 0.05):
        recording.send(Kind.FRAME, {"stamp": moment})
    return [drive(n, now - seconds, HELD) for n in range(int(seconds * rate))]


def test_stop_wins_over_what_a_stalled_server_finds(hub, ends):
    robot, queued = Robot(ends[0]), stalled(ends[0])
    queued.insert(len(queued) * 9 // 10, ask_for("stop", press=7))
    now = time.monotonic()
    queued += [ask_for("stop", press=7), drive(1000, now), drive(1001, now, HELD)]  # repeated, let go, held
    serve(hub, QueuedSocket(queued))
    assert not robot.moves()
    assert robot.person.phase is Phase.STOPPED


def test_a_page_is_told_which_press_was_heard(hub):
    """Only after that a picture of a robot that stands answers it."""

    class Stays(QueuedSocket):
        async def receive(self):
            await asyncio.sleep(0.0 if self.left else 0.5)
            return await super().receive()

    page = Stays([ask_for("stop", press=7)])
    serve(hub, page)
    assert {"kind": "heard", "press": 7} in page.said


def test_messages_queued_over_a_stall_do_not_steer(hub, ends):
    """Without a STOP, too: it answers pictures of before."""
    now = time.monotonic()
    serve(hub, QueuedSocket([*stalled(ends[0], 3.0), drive(1000, now), drive(1001, now, [0.5] * 18)]))
    axes = [data[0]["axes"][0] for kind, data in ends[0].receive() if kind == Kind.DRIVE]
    assert axes == [0.0, 0.5]


@pytest.mark.parametrize("before", ["start", "mode", "stop"])
def test_stop_is_heard_before_what_is_queued_in_front_of_it(hub, ends, before):
    """Nothing that was said before it steers, chooses or releases any more."""
    value = {"start": True, "mode": "direct", "stop": False}[before]
    now = time.monotonic()
    burst = [drive(n, now, HELD) if n % 2 else ask_for(before, value) for n in range(BURST - 1)]
    serve(hub, QueuedSocket([*burst, ask_for("stop")]))
    kinds = [kind for kind, _ in ends[0].receive()]
    assert kinds[0] == Kind.STOP
    assert set(kinds) <= {Kind.STOP, Kind.LOST}


@pytest.mark.parametrize("what", sorted(STILLS))
def test_an_end_or_a_pause_is_never_too_much(hub, ends, what):
    now = time.monotonic()
    burst = [drive(n, now, HELD) for n in range(BURST)]
    serve(hub, QueuedSocket([*burst, ask_for(what), ask_for("start")]))
    said = [data["what"] for kind, data in ends[0].receive() if kind in (Kind.ASK, Kind.STILL)]
    assert said == [what]


def test_letting_go_is_never_too_much(hub, ends):
    now = time.monotonic()
    serve(hub, QueuedSocket([*(drive(n, now, HELD) for n in range(BURST)), drive(BURST, now)]))
    inputs = [data[0] for kind, data in ends[0].receive() if kind == Kind.DRIVE]
    assert len(inputs) < BURST / 2
    assert not any(inputs[-1]["axes"])


def test_a_page_that_answers_an_old_picture_still_lets_go(hub, ends):
    stale = stalled(ends[0])
    serve(hub, QueuedSocket([*stale, drive(1000, time.monotonic() - 4.0)]))
    (inputs,) = [data[0] for kind, data in ends[0].receive() if kind == Kind.DRIVE]
    assert not inputs["on"]
    assert not any(inputs["axes"])


def test_giving_back_the_lease_is_never_too_much(hub, ends):
    now = time.monotonic()
    burst = [drive(n, now, HELD) for n in range(BURST)]
    serve(hub, QueuedSocket([*burst, ask_for("give")]))
    assert ends[0].receive()[-1] == (Kind.LOST, None)
    run(hub.serve(QueuedSocket([drive(1, now)]), "another-page"))  # else it would be kept for the first
    assert Kind.DRIVE in [kind for kind, _ in ends[0].receive()]


def test_a_page_that_is_gone_is_lost_whatever_it_had_queued(hub, ends):
    serve(hub, QueuedSocket([drive(n, time.monotonic(), HELD) for n in range(BURST)]))
    assert ends[0].receive()[-1] == (Kind.LOST, None)


def test_a_page_that_is_cut_off_still_stops(hub, ends):
    page = QueuedSocket(
        ["nonsense"] * 60 + ["x" * 5000, ask_for("stop")] + ["nonsense"] * 1200 + [ask_for("stop")]
    )
    serve(hub, page)
    assert [kind for kind, _ in ends[0].receive() if kind == Kind.STOP] == [Kind.STOP, Kind.STOP]


def test_a_press_that_is_said_again_stops_once(hub, ends):
    """Also by another connection of the page: whoever released it meanwhile has seen to it."""
    for _ in range(3):
        serve(hub, QueuedSocket([ask_for("stop", press=11)] * 5))
    serve(hub, QueuedSocket([ask_for("stop", press=12)]))
    serve(hub, QueuedSocket([ask_for("stop")]), QueuedSocket([ask_for("stop")]))
    assert [kind for kind, _ in ends[0].receive()].count(Kind.STOP) == 4


def test_only_who_has_seen_the_stop_releases_it(hub, ends):
    """A release may have been on its way when somebody else pressed STOP."""
    before = time.monotonic()
    serve(hub, QueuedSocket([ask_for("stop", press=1)]))
    page = QueuedSocket([drive(1, before), ask_for("stop", False)])
    serve(hub, page)
    assert not [data for kind, data in ends[0].receive() if kind == Kind.ASK]
    serve(hub, QueuedSocket([drive(1, time.monotonic()), ask_for("stop", False)]))
    (release,) = [data for kind, data in ends[0].receive() if kind == Kind.ASK]
    assert release == {"what": "stop", "value": False}


@pytest.mark.parametrize("press", [None, "x", 1.5, [], True, {}])
def test_a_stop_is_a_stop_whatever_else_it_says(hub, ends, press):
    serve(hub, QueuedSocket([ask_for("stop", press=press, more=1)]))
    assert (Kind.STOP, None) in ends[0].receive()


@pytest.mark.parametrize("who", ["driver", "watcher"])
def test_a_server_that_was_stopped_hears_the_stop(who):
    """The web server itself stands still; a page says 600 messages, then it or another one STOP."""
    with server() as served:
        stage(served)
        robot = Robot(served.pipe)
        with page(served, "page-number-one") as driver, page(served, "page-number-two") as watcher:
            told(driver, "stage")
            stamp = seen(served, driver, 1)
            os.kill(served.process.pid, signal.SIGSTOP)
            show(served, n=2)
            for number in range(BURST):
                driver.send(drive(number, stamp, HELD))
            {"driver": driver, "watcher": watcher}[who].send(ask_for("stop", press=3))
            driver.send(drive(BURST, stamp))
            driver.send(drive(BURST + 1, stamp, HELD))
            os.kill(served.process.pid, signal.SIGCONT)
            deadline = time.monotonic() + 60.0
            while robot.person.phase is not Phase.STOPPED:
                assert time.monotonic() < deadline
                robot.moves()
                time.sleep(0.01)
            number = BURST + 2
            while robot.deflection != 0.5:
                fresh = seen(served, driver, number)
                driver.send(drive(number, fresh))
                driver.send(drive(number + 1, fresh, [0.5] * 18))
                number += 2
                time.sleep(0.05)  # as a page does: whoever says more than 150 messages a second is not heard
                assert not robot.moves()
            assert robot.person.phase is Phase.STOPPED
