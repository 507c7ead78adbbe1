"""The simulated LeKiwi's host loop, without a network: commands, watchdog, latency, losses, a lost camera."""

import json
import math
from dataclasses import replace
from unittest import mock

import numpy as np
import pytest
from command_helpers import refused
from lekiwi_helpers import PlayedClient, wired

from handrail.collect.lekiwi import host
from handrail.collect.lekiwi.body import LeKiwiBody
from handrail.collect.lekiwi.host_config import HostConfig
from handrail.collect.lekiwi.host_loop import EPISODE, SEED, SENT, LeKiwiLoop, Wire
from handrail.collect.lekiwi.link import Link
from handrail.collect.processor.units import robot_units
from handrail.collect.world.env import HandrailEnv
from handrail.collect.world.tasks.reach import Reach
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import load_model

STILL = {"x.vel": 0.0, "y.vel": 0.0, "theta.vel": 0.0}
AHEAD = {**STILL, "x.vel": 0.1}
PERIOD = 1.0 / 30.0


class Hosted:
    """A host whose time a test lets pass; any robot on wheels will do."""

    def __init__(self, **settings) -> None:
        env = HandrailEnv(Reach(), "ridgeback_ur10", fps=60)
        self.body = LeKiwiBody(env, robot_units("lekiwi", env.model.description))
        self.loop = LeKiwiLoop(self.body, replace(HostConfig(), **settings), 0.0)
        self.now, self.answers, self.times = 0.0, [], []

    def go(self, seconds: float, *commands: dict | bytes) -> dict:
        """Send the same commands in every round; return the last observation."""
        messages = [c if isinstance(c, bytes) else json.dumps(c).encode() for c in commands]
        for _ in range(round(seconds / PERIOD)):
            self.now += PERIOD
            if parts := self.loop.tick(self.now, messages, 1000.0 + self.now):
                self.answers.append(parts)
                self.times.append(self.now)
        return json.loads(self.answers[-1][0])


def test_it_drives_turns_and_moves_its_arm_in_lekiwis_units():
    hosted = Hosted()
    before = hosted.body.base
    said = hosted.go(2.0, {**AHEAD, "theta.vel": 10.0, "arm_elbow_joint.pos": 80.0})
    assert said["x.vel"] == pytest.approx(0.1, abs=0.01)
    assert said["theta.vel"] == pytest.approx(10.0, abs=0.5)
    assert said["arm_elbow_joint.pos"] == pytest.approx(80.0, abs=1.0)
    away = hosted.body.base - before
    assert away == pytest.approx([0.19, 0.03, math.radians(19.0)], abs=0.03)


def test_the_base_stops_when_no_command_comes_and_the_arm_stays():
    hosted = Hosted()
    held = hosted.go(1.0, AHEAD)["arm_elbow_joint.pos"]
    assert hosted.go(0.4)["x.vel"] == pytest.approx(0.1, abs=0.01)  # not yet
    said = hosted.go(0.6)
    assert abs(said["x.vel"]) < 1e-3
    assert said["arm_elbow_joint.pos"] == pytest.approx(held, abs=0.1)
    assert hosted.loop.stops == 1
    assert hosted.go(0.5, AHEAD)["x.vel"] == pytest.approx(0.1, abs=0.01)  # and goes on with the next one


@pytest.mark.parametrize(
    "nonsense",
    [
        b"\xff",
        b"[1, 2]",
        b"{}",
        {"x.vel": 0.1},
        {**AHEAD, "x.vel": math.nan},
        {**AHEAD, "theta.vel": "much"},
        {**AHEAD, "arm_elbow_joint.pos": math.inf},
        {**AHEAD, EPISODE: 1.0, SEED: math.nan},
        {**AHEAD, EPISODE: 1.0, SEED: 7.0, "x.vel": math.nan},
    ],
)
def test_nonsense_moves_nothing_and_is_no_sign_of_life(nonsense, caplog):
    hosted = Hosted()
    hosted.go(0.5, AHEAD)
    said = hosted.go(1.5, nonsense)
    assert abs(said["x.vel"]) < 1e-3
    assert hosted.loop.stops == 1
    assert hosted.loop.malformed == 45
    assert len(hosted.loop.episodes) == 1
    assert [each.message.partition(":")[0] for each in caplog.records] == ["a command makes no sense"]


def test_a_seed_begins_an_episode_once():
    hosted = Hosted()
    here = {**AHEAD, EPISODE: 1.0, SEED: 7.0, SENT: 1000.0}
    hosted.go(1.0, here)
    assert [each["seed"] for each in hosted.loop.episodes] == [0, 7]
    assert hosted.body.time == pytest.approx(1.0, abs=0.1)
    hosted.go(1.0, {**here, EPISODE: 2.0})
    assert hosted.body.time == pytest.approx(1.0, abs=0.1)
    ages = hosted.loop.summary()["command_age_ms"]
    assert ages["p100"] == pytest.approx(1000.0, abs=40.0)  # the same message again is no command


def test_a_second_recorder_s_first_episode_begins():
    """Of another process, which counts anew."""
    hosted = Hosted()
    for seed, clock in ((111, 1000.0), (222, 1060.0)):
        client = PlayedClient()
        with mock.patch("time.time", lambda clock=clock: clock):
            far = Link(client, "lekiwi", load_model("lekiwi"), 0.05, True, client.clock, client.sleep)
            far.begin(seed)
            far.exchange(())
        hosted.go(0.1, json.dumps(client.sent[-1]).encode())
    assert [each["seed"] for each in hosted.loop.episodes] == [0, 111, 222]


def test_a_robot_is_not_driven_as_a_simulation():
    """A script may drive that one, with nobody to stop it."""
    with pytest.raises(HandrailError, match="expected handrail-lekiwi host, got a robot"), wired(True):
        pass
    with wired(True, **{EPISODE: 0.0}) as (_, link):
        assert not link.body.trouble


def test_a_slow_network_is_late_by_as_much_and_loses_its_share():
    prompt, late = Hosted(), Hosted(latency=0.2)
    begun = []
    for hosted in (prompt, late):
        hosted.go(1.0, AHEAD)
        speeds = [json.loads(parts[0])["x.vel"] for parts in hosted.answers]
        begun.append(next(t for t, speed in zip(hosted.times, speeds, strict=True) if speed > 0.05))
    assert begun[1] - begun[0] == pytest.approx(0.4, abs=2 * PERIOD)  # there and back
    lossy = Hosted(drop=0.5)
    lossy.go(10.0, STILL)
    assert len(lossy.answers) == pytest.approx(150, abs=30)
    assert lossy.loop.summary()["messages_lost"] == pytest.approx(300, abs=45)


def test_the_newest_message_wins():
    wire: Wire[int] = Wire(0.1, 0.0, np.random.default_rng(0))
    for index in range(5):
        wire.put(index, 0.02 * index)
    assert wire.newest(0.05) is None
    assert wire.newest(0.15) == 2
    assert wire.newest(1.0) == 4
    assert wire.newest(1.0) is None


def test_cameras_say_jpegs_of_lekiwis_sizes_and_a_lost_one_says_nothing(monkeypatch):
    import cv2

    hosted = Hosted(cameras="front,wrist", lost_camera="wrist")
    picture = np.zeros((480, 640, 3), np.uint8)
    picture[..., 0] = 200
    monkeypatch.setattr(LeKiwiBody, "picture", lambda self, camera: picture)
    said = hosted.go(0.2, STILL)
    assert said["_cams"] == ["front", "wrist"]
    _, front, wrist = hosted.answers[-1]
    assert wrist == b""
    seen = cv2.imdecode(np.frombuffer(front, np.uint8), cv2.IMREAD_COLOR)  # as LeRobot's client does
    assert seen is not None
    assert seen.shape == (480, 640, 3)
    assert seen[0, 0].tolist() == pytest.approx([200, 0, 0], abs=5)  # red stays red


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--drop", "2"], "--drop: expected a number <= 1.0"),
        (["--cameras", "front,back"], "unknown camera 'back'"),
        (["--port_zmq_cmd", "5556"], "expected two ports"),
        (["--task", "juggle"], "unknown task 'juggle'"),
        (["--address", "nowhere"], "nowhere"),
        (["--robot", "ridgeback_ur10"], "expected a LeKiwi"),
        (["--robot", "bi_so101"], "expected a LeKiwi"),
    ],
)
def test_wrong_settings_are_named(words, said):
    refused(*words, name="lekiwi host", told=said)


def test_what_it_saw_is_said_also_where_it_cannot_be_written(tmp_path, monkeypatch):
    class NoSockets:
        receive = close = staticmethod(list)

    def interrupt(seconds):
        raise KeyboardInterrupt

    said = []
    monkeypatch.setattr(host, "HostSockets", lambda config: NoSockets())
    monkeypatch.setattr(host.time, "sleep", interrupt)
    (tmp_path / "saw.json").mkdir()
    with pytest.raises(HandrailError, match=r"--json .*saw\.json: Is a directory"):
        host.serve(HostConfig(json=str(tmp_path / "saw.json")), said.append)
    assert json.loads(said[-1])["commands"] == 0
