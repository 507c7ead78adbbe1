"""Laws of what the page is told while nobody drives: pictures are of now, nothing is offered in vain."""

import io
from collections import Counter
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from collect_helpers import environment
from PIL import Image

from handrail.collect.cockpit import cockpit
from handrail.collect.cockpit.pipe import Kind
from handrail.collect.cockpit.strain import Strain
from handrail.collect.commands.record import record
from handrail.collect.config import DatasetConfig, DriveConfig, FoundDatasetConfig, RecordConfig
from handrail.collect.operators.operator import EpisodeEvent, View
from handrail.collect.operators.person.inputs import Ask
from handrail.collect.operators.person.person import Phase
from handrail.controllers.errors import HandrailError
from handrail.datasets.recording.writer import EpisodeWriter

ENDS = (Kind.ASK, "start"), (Kind.STILL, "failure")  # of an episode at once


class Server:
    """Keeps what it is sent."""

    def __init__(self):
        self.pipe, self.dropped, self.sent = self, Counter(), list[tuple[Kind, object]]()

    def send(self, kind, value=None, *more):
        self.sent.append((kind, value))

    send_surely = send

    def of(self, kind):
        return [value for each, value in self.sent if each is kind]

    def keep(self, name, data):
        pass

    def receive(self):
        return []


@pytest.fixture
def opened(monkeypatch):
    """Open the cockpit of a robot; give it, what its server was sent, and what there is to see."""
    server = Server()
    monkeypatch.setattr(cockpit, "open_server", lambda config, say: server)
    monkeypatch.setattr(Strain, "picture_period", 0.0)
    with environment("Reach") as env:

        def made(real=False, begins=True, policy=()):
            env.reset(seed=3)
            monkeypatch.setattr(env, "real", real)
            config = RecordConfig(
                task="reach", mode="ee", policy=policy, dataset=DatasetConfig(place="somewhere")
            )
            person = cockpit.open_cockpit(config, env, lambda words: None)
            view = View(env.plant.state(), env.task_state())
            person.begin(env, 3)
            if begins:
                person.reset(view, np.random.default_rng(0))
            return person, server, view

        yield made


def test_start_said_while_an_episode_is_saved_begins_none_and_a_stop_holds(opened):
    """Nobody has seen the next scene yet."""
    for said, phase in ((Kind.ASK, Phase.READY), (Kind.STOP, Phase.STOPPED)):
        person, server, view = opened()
        said_then = [(said, {"what": "start", "value": True})]
        server.receive = lambda waiting=said_then: [waiting.pop()] if waiting else []
        person.reset(view, np.random.default_rng(0))
        assert person.act(view) is EpisodeEvent.PAUSE
        assert person.person.phase is phase


def test_what_is_pressed_before_the_first_episode_is_no_error(opened):
    person, server, view = opened(begins=False)
    said = [(Kind.ASK, {"what": "practice", "value": True}), (Kind.ASK, {"what": "quit", "value": True})]
    server.receive = lambda: [said.pop()] if said else []
    person.person.grip(0)
    person.reset(view, np.random.default_rng(0))
    assert person.person.closed == [0.0]
    assert person.act(view) is EpisodeEvent.QUIT


def test_beside_a_policy_no_joint_is_held_still(opened):
    """The policy would move it: the page does not offer it."""
    for policy in (), ("some/folder",):
        person, server, view = opened(policy=policy)
        said = [(Kind.ASK, {"what": "lock", "value": [3]})]
        server.receive = lambda waiting=said: [waiting.pop()] if waiting else []
        person.act(view)
        assert person.person.setting.locked == (() if policy else (3,))
        assert server.of(Kind.STAGE)[-1]["refuses"] == (["lock"] if policy else [])


def shade(jpeg):
    return np.asarray(Image.open(io.BytesIO(jpeg[1:]))).mean()


def test_in_a_pause_pictures_are_of_now(opened):
    """Before Start, after an undo and while a real robot is paused there are no frames."""
    person, server, view = opened()
    for level in (10, 200):
        pixels = {"front": np.full((32, 48, 3), level, np.uint8)}
        person.act(replace(view, observation={"pixels": pixels}))
        assert shade(server.of(Kind.PICTURE)[-1]) == pytest.approx(level, abs=3)


@pytest.mark.parametrize("error", [HandrailError("no room"), ValueError("no room"), KeyboardInterrupt()])
def test_the_page_hears_why_a_recording_ended(tmp_path, monkeypatch, error):
    def fails(*_):
        raise error

    server = Server()
    server.receive = lambda: [(kind, {"what": what, "value": True}) for kind, what in ENDS]
    monkeypatch.setattr(server, "close", lambda: None, raising=False)
    monkeypatch.setattr(cockpit, "open_server", lambda config, say: server)
    monkeypatch.setattr(EpisodeWriter, "save_episode", fails)
    place = FoundDatasetConfig(place=str(tmp_path / "d"), num_episodes=1)
    with suppress(ValueError):
        record(DriveConfig(mode="direct", dataset=place))
    (over,) = server.of(Kind.OVER)
    assert isinstance(over, dict)
    assert (over["saved"], over["trouble"]) == (0, str(error))


@pytest.mark.parametrize("real", [False, True])
def test_only_what_a_robot_can_do_is_offered(opened, real):
    person, server, view = opened(real)
    assert ("undo" in server.of(Kind.STAGE)[-1]["refuses"]) == real
    person.person.ask(Ask("start"))
    for time in (0.0, 3.0):
        moving = replace(view.state, time=time, commanded=np.full(len(view.state.q), time))
        person.act(replace(view, state=moving))
    assert server.of(Kind.FRAME)[-1]["undo_takes"] == (0.0 if real else 3.0)
