"""A robot behind a client moves no further than it may, whatever it says; it brakes whoever lets it go."""

import json
import subprocess
import sys
import threading
from types import SimpleNamespace
from unittest import mock

import numpy as np
import pytest
from command_helpers import command
from driven_person import Driven
from lekiwi_helpers import GOOD, ZERO, PlayedClient, wired
from processor_helpers import PERIOD

from handrail.collect.client_config import ClientConfig
from handrail.collect.lekiwi import client_plant
from handrail.collect.lekiwi.client_plant import ClientPlant, bring_home
from handrail.collect.lekiwi.link import Link, connect
from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.operators.person.inputs import Ask
from handrail.collect.processor.units import robot_units
from handrail.collect.processor.whole_body import WholeBody
from handrail.collect.session.session import Session
from handrail.collect.world.env import HandrailEnv
from handrail.collect.world.scene import Scene, Viewpoint
from handrail.collect.world.tasks.reach import Reach
from handrail.controllers.errors import HandrailError
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.robot.model import load_model

MODEL = load_model("lekiwi")
UNITS = robot_units("lekiwi", MODEL.description)
FASTEST, BASE = MODEL.description.limits.velocity, 3
HOME = MODEL.description.home
JUNK = [{}, [], None, 5, {"_cams": []}, {"_cams": [], **GOOD, "x.vel": "fast"}, {"_cams": [[1]]}]
JUNK += [{"_cams": [], **{name: GOOD[name] for name in GOOD if name != lacking}} for lacking in GOOD]


def played(client: PlayedClient) -> Link:
    return Link(client, "lekiwi", MODEL, 0.05, True, client.clock, client.sleep)


def targets(action: dict) -> np.ndarray:
    return UNITS.joint_positions(np.array([action[name] for name in UNITS.positions]))


@pytest.mark.parametrize("glitch", [0.1, 0.3, -1.0, 3.0, 1e6])
@pytest.mark.parametrize("pushed", [0.0, 10.0])
def test_no_reading_moves_a_target_faster_than_its_joint_may(glitch, pushed):
    """Braking or not, once or for good; a joint that really is elsewhere is followed there."""
    body, arm, before = WholeBody(MODEL, UNITS, PERIOD), HOME[BASE:].copy(), HOME[BASE:]
    for period in range(200):
        wrong = glitch * np.eye(5)[2] * (period == 20 or period > 40)
        body.observe(UNITS.action(arm + wrong, np.zeros(5), np.zeros(3), (0.0,)), period * PERIOD)
        if period == 20:
            assert bool(body.trouble) == (abs(glitch) > 0.2 + FASTEST[BASE + 2] * PERIOD)
        now = targets(body.send(() if period > 10 else np.full(MODEL.size + 1, pushed)))
        assert (np.abs(now - before) <= FASTEST[BASE:] * PERIOD + 1e-9).all()
        before = now
    assert abs(glitch) > 3.0 or abs(now[2] - arm[2] - glitch) <= 0.2 + 1e-9


def test_a_velocity_that_no_base_has_is_no_observation():
    """One such number would put the base elsewhere for good."""
    body, arm = WholeBody(MODEL, UNITS, PERIOD), HOME[BASE:]
    for period in range(20):
        fast = -5.0 if period == 10 else 0.0
        state = body.observe(
            UNITS.action(arm, np.zeros(5), np.array([fast, 0.0, 0.0]), (0.0,)), period * PERIOD
        )
        assert bool(body.trouble) == bool(fast)
        assert np.abs(state.q[:3]).max() < 1e-9


def test_a_clock_that_goes_back_makes_nothing_fresh():
    """The very same observation again, while the clock jumps: stale after its time all the same."""
    body, said = WholeBody(MODEL, UNITS, PERIOD), UNITS.action(HOME[BASE:], np.zeros(5), np.zeros(3), (0.0,))
    times = [0.0, PERIOD, *(2 * PERIOD - 100.0 + PERIOD * k for k in range(20))]
    for time in times:
        body.observe(said, time)
    assert body.trouble == "stale_observation"


def test_a_zero_for_every_key_is_no_observation():
    body = WholeBody(MODEL, UNITS, PERIOD)
    body.observe(dict(GOOD), 0.0)
    sent = body.send(())
    body.observe(dict.fromkeys(UNITS.observation_names, 0.0), PERIOD)
    assert body.trouble == "malformed_observation"
    assert body.send(()) == sent


@pytest.fixture
def wire():
    with wired() as found:
        yield found


HOST = """
import sys, zmq
context = zmq.Context()
takes, says = context.socket(zmq.PULL), context.socket(zmq.PUSH)
print(*(each.bind_to_random_port("tcp://127.0.0.1") for each in (takes, says)), flush=True)
while True:
    says.send_string(sys.argv[1])
    takes.recv()
"""


def test_a_robot_whose_host_has_died_can_be_let_go():
    """Before, what it had not taken was waited for: the recording never ended."""
    pytest.importorskip("zmq", reason="pip install '.[lekiwi]'")
    words = [sys.executable, "-c", HOST, json.dumps({"_cams": [], **GOOD})]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as host:
        assert host.stdout
        ports = map(int, host.stdout.readline().split())
        link = connect("lekiwi", ClientConfig("127.0.0.1", *ports), (), MODEL, 20)
        link.exchange([0.1, 0, 0, 0, 0, 0, 0, 0, 0])
        host.kill()
    with pytest.raises(HandrailError, match="nothing usable heard"):
        until(link, lambda: False)
    closing = threading.Thread(target=link.close, daemon=True)
    closing.start()
    closing.join(20.0)
    assert not closing.is_alive()


def until(link: Link, so) -> None:
    """Let it brake until something is so, or for less than the time after which the robot is gone."""
    for _ in range(90):
        if so():
            return
        link.exchange(())
    raise TimeoutError


@pytest.mark.parametrize("junk", JUNK, ids=lambda junk: json.dumps(junk)[-40:])
def test_junk_through_lerobot_s_client_moves_nothing_and_is_no_sign_of_life(junk, wire):
    says, link = wire
    before, heard = link.body.targets, link.state.q
    says.send_json(junk)
    if isinstance(junk, dict) and junk.get("_cams") == [] and junk.get("x.vel") != "fast":
        until(link, lambda: link.body.trouble == "malformed_observation")
    for _ in range(3):
        link.exchange(())
    assert np.array_equal(link.body.targets, before)
    assert np.array_equal(link.state.q, heard)
    says.send_json({"_cams": [], **GOOD, "arm_gripper.pos": 0.0})
    until(link, lambda: link.body.openings == 0.0)
    assert not link.body.trouble


class Waits:
    """Pauses for so many periods, then says that it is over; notes the time and how old what it sees is."""

    def __init__(self, client, periods):
        self.client, self.left, self.ages, self.times = client, periods, [], []

    def reset(self, view, rng):
        self.began = self.client.clock.now - view.state.time

    def act(self, view):
        self.ages.append(self.client.clock.now - self.began - view.state.time)
        self.times.append(self.client.clock.now)
        self.left -= 1
        return EpisodeEvent.PAUSE if self.left > 0 else EpisodeEvent.SUCCESS


def session(client, operator, observers):
    link = played(client)
    env = HandrailEnv(
        Reach(),
        MODEL,
        fps=20,
        real=True,
        plant=lambda model, scene, q, period, **looks: ClientPlant(model, scene, q, link, 3),
    )
    return Session(env, MaskedMpc(MODEL), operator, observers)


def test_a_pause_at_rest_is_in_real_time_and_the_robot_is_heard():
    client, frames = PlayedClient(), []
    waits = Waits(client, 100)
    watcher = SimpleNamespace(begin=lambda env, seed: None, see=frames.append)
    outcome = session(client, waits, [watcher]).run(3)
    assert np.diff(waits.times) == pytest.approx(0.05)
    assert max(waits.ages) < 0.06
    assert outcome.frames <= 3  # of which none is a pause's
    assert outcome.success


def test_messages_that_waited_while_the_loop_halted_are_read_first():
    client = PlayedClient()
    link, queue, answer = played(client), [], client.get_observation
    client.get_observation = lambda: queue.pop(0) if queue else answer()
    for _ in range(5):
        link.exchange(())
    for _ in range(60):
        client.sleep(1 / 30)
        queue.append(dict(answer(), **{"arm_gripper.pos": 35.0}))
    link.exchange(())
    assert not queue
    link.close()


def test_a_command_is_not_said_again_after_a_halt():
    """Its robot's watchdog has stopped the base."""
    client, halt = PlayedClient(), [0.0]
    sleep = client.sleep
    client.sleep = lambda seconds: sleep(seconds + halt[0])
    link = played(client)
    link.exchange(())
    halt[0], client.sent = 3.0, []
    link.exchange(())
    assert len(client.sent) == 1
    link.close()


def test_the_drive_home_brakes_while_it_is_stopped_and_stays_where_the_recording_ends():
    client, driven = PlayedClient(), Driven("gamepad")
    link, q = played(client), HOME.copy()
    q[BASE] += 1.0
    link.asked = driven.local.between
    speeds, exchange = [], link.exchange

    def watched(command):
        sent = exchange(command)
        speeds.append(np.abs(link.body.velocity).max())
        match len(speeds):
            case 10:
                driven.person.ask(Ask("stop"))
            case 50:
                driven.person.ask(Ask("stop", False))
            case 60:
                driven.main.gone = True
            case 100:
                driven.main.gone = False
            case 110:
                driven.person.ask(Ask("stop"))
                driven.person.ask(Ask("quit"))
        return sent

    link.exchange = watched
    bring_home(link, q)
    assert len(speeds) == 110
    for first, last in ((0, 10), (50, 60), (100, 110)):
        assert max(speeds[first + 3 : last]) > 0.05
    assert not any(speeds[30:50] + speeds[80:100])
    driven.local.reset(driven.view(), np.random.default_rng(0))
    assert driven.act() is EpisodeEvent.QUIT
    link.close()
    assert not link.body.velocity.any()


def test_nothing_moves_before_there_is_somebody_to_stop_it(tmp_path):
    client = PlayedClient()
    flags = ("--robot", "lekiwi", "--robot_client", "lekiwi", "--task", "reach", "--client.simulated")
    with (
        mock.patch.object(client_plant, "connect", side_effect=lambda *_: played(client)),
        mock.patch("handrail.collect.devices.open_devices.open_device", side_effect=HandrailError("no pad")),
    ):
        done = command(tmp_path / "set", *flags, "--operator", "gamepad")
    assert "no pad" in done.stderr
    assert not client.sent


@pytest.mark.parametrize("ends", ["plant", "link"])
def test_a_robot_that_cannot_be_heard_any_more_is_braked_to_rest(ends):
    client = PlayedClient()
    link = played(client)
    plant = ClientPlant(MODEL, Scene((), Viewpoint((0, 0, 1), (0, 0, 0))), HOME, link, 3)
    for _ in range(30):
        link.exchange([0.1, 0, 0, 0, 0, 0, 0, 0, 0])
    assert abs(client.sent[-1]["x.vel"]) > 0.05
    client.get_observation = mock.Mock(side_effect=ValueError("bad JPEG"))
    with pytest.raises(HandrailError, match="cannot be heard: bad JPEG"):
        link.exchange([0.1, 0, 0, 0, 0, 0, 0, 0, 0])
    plant.stop() if ends == "plant" else link.close()
    assert all(client.sent[-1][name] == 0.0 for name in ZERO)
    link.close()
