"""A LeKiwi behind a client in this process: simulated, in time that passes only when somebody sleeps."""

import json
import threading
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from fuzz_helpers import RudeOperator
from processor_helpers import Clock

from handrail.collect.client_config import ClientConfig
from handrail.collect.lekiwi.body import LeKiwiBody
from handrail.collect.lekiwi.client_plant import ClientPlant
from handrail.collect.lekiwi.host_config import HostConfig
from handrail.collect.lekiwi.host_loop import SEED, LeKiwiLoop
from handrail.collect.lekiwi.link import Link, connect
from handrail.collect.processor.units import robot_units
from handrail.collect.world.env import HandrailEnv
from handrail.collect.world.tasks.pick_place import PickPlace
from handrail.collect.world.tasks.reach import Reach
from handrail.controllers.interface.intent import Intent
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.robot.model import load_model

ZERO = ("x.vel", "y.vel", "theta.vel")
_MODEL = load_model("lekiwi")
GOOD = robot_units("lekiwi", _MODEL.description).action(
    _MODEL.description.home[3:], np.zeros(5), np.zeros(3), (0.0,)
)
"""What a robot at rest says."""


class PlayedClient:
    """Answers as LeRobot's LeKiwiClient does: while nothing new comes, with the very same object again.

    Attributes:
        silent: when it says nothing, from and to [s].
        sent: every action.
    """

    def __init__(
        self, silent: tuple[float, float] = (0.0, 0.0), cameras: dict[str, Any] | None = None
    ) -> None:
        self.clock, self.silent, self.cameras = Clock(), silent, cameras or {}
        env = HandrailEnv(Reach(), "lekiwi", fps=60)
        self.body = LeKiwiBody(env, robot_units("lekiwi", env.model.description))
        self.sent: list[dict[str, Any]] = []
        self.connected, self.stubborn, self.leap = False, False, 0.0
        self.last, self.said_at, self.began, self.seed = {}, -1.0, self.clock.now, None
        self.body.reset(0)

    @property
    def action_features(self) -> dict[str, type]:
        return dict.fromkeys(self.body.observation(), float)

    def connect(self) -> None:
        self.connected = True

    def disconnect(self) -> None:
        self.connected = False

    def sleep(self, seconds: float) -> None:
        self.clock.now += seconds

    def send_action(self, action: dict[str, Any]) -> None:
        self.sent.append(action)
        if action.get(SEED, self.seed) != self.seed:
            self.seed, self.began = action[SEED], self.clock.now
            self.body.reset(int(action[SEED]))
        if not self.stubborn:
            assert self.body.take(action)

    def get_observation(self) -> dict[str, Any]:
        now = self.clock.now - 100.0
        if self.clock.now > self.said_at and not self.silent[0] <= now < self.silent[1]:
            self.body.advance(self.clock.now - self.began)
            self.last, self.said_at = {**self.body.observation(), **self.cameras}, self.clock.now
        return self.last


class FarClient:
    """A simulated LeKiwi's host behind a network that is late and loses messages; time passes in `sleep`."""

    def __init__(self, latency: float, drop: float, seed: int) -> None:
        self.clock = Clock()
        env = HandrailEnv(PickPlace(), "lekiwi", fps=60)
        self.body = LeKiwiBody(env, robot_units("lekiwi", env.model.description))
        config = HostConfig(task="pick_place", latency=latency, drop=drop, seed=seed)
        self.loop = LeKiwiLoop(self.body, config, self.clock.now)
        self.action_features = dict.fromkeys(self.body.observation(), float)
        self.link: Link | None = None
        self._commands: list[bytes] = []
        self._said: dict[str, Any] = {}
        self.deaf, self._heard = False, self._said
        self._turn = self.clock.now
        self.sleep(2.0 * latency + 0.1)

    def connect(self) -> None:
        pass

    def disconnect(self) -> None:
        pass

    def sleep(self, seconds: float) -> None:
        """Let time pass for the host, and for the link's own thread."""
        end = self.clock.now + seconds
        while self.clock.now < end - 1e-9:
            self.clock.now = min(end, self.clock.now + 0.01)
            if self.clock.now - self._turn >= 1 / 30 - 1e-9:
                self._turn = self.clock.now
                if parts := self.loop.tick(self.clock.now, self._commands[-1:]):
                    self._said = {
                        name: value for name, value in json.loads(parts[0]).items() if name[0] != "_"
                    }
                self._commands = []
            if self.link:
                self.link.brake_if_late()

    def send_action(self, action: dict[str, Any]) -> None:
        self._commands.append(json.dumps(action).encode())

    def get_observation(self) -> dict[str, Any]:
        self._heard = self._heard if self.deaf else self._said
        return self._heard


def _linked(latency: float, drop: float, seed: int) -> tuple[FarClient, Link, HandrailEnv, MaskedMpc]:
    """Return a LeKiwi behind a network, the link to it, its environment, and the MPC in its scene."""
    client, model = FarClient(latency, drop, seed), load_model("lekiwi")
    link = client.link = Link(client, "lekiwi", model, 0.05, True, client.clock, client.sleep)

    def plant(robot, scene, q, period, **looks):
        return ClientPlant(robot, scene, q, link, seed)

    env = HandrailEnv(PickPlace(), "lekiwi", fps=20, real=True, plant=plant)
    env.reset(seed=seed)
    mpc = MaskedMpc(model)
    mpc.reset(env.plant.obstacles())
    return client, link, env, mpc


def rude_drive(gap: float, latency: float, drop: float, seed: int, seconds: float) -> tuple[int, float]:
    """Drive a LeKiwi over a network with rude intents; return its contacts, and the base's way [m].

    Args:
        gap: by which every update is late [s].
        latency: of commands and observations, each [s].
        drop: share of the messages that are lost.
        seed: of the scene and the intents.
        seconds: how long.
    """
    client, link, env, mpc = _linked(latency, drop, seed)
    rude = RudeOperator(mpc.channels, env.model.description.limits, np.random.default_rng([seed, 7]))
    before, begun, way, place = client.body.contacts, client.clock.now, 0.0, env.state().q
    while client.clock.now - begun < seconds:
        client.sleep(gap)
        state = env.state()
        way, place = way + float(np.linalg.norm(state.q[:2] - place[:2])), state.q
        command = mpc.update(state, rude.intent(state.time))
        env.plant.send(np.append(command.velocity(0.05), 0.0))
    link.close()
    return client.body.contacts - before, way


def interrupted_drive(cut: str, seconds: float, seed: int) -> tuple[list[float], int]:
    """Drive a LeKiwi's base at furniture, cut off six times; return how far ahead it is thought and contacts.

    Args:
        cut: deaf, the robot is not heard, or halted, the loop stands.
        seconds: how long each time.
        seed: of the scene.
    """
    client, link, env, mpc = _linked(0.0, 0.0, seed)
    mask = mpc.channels.mask("base")

    def drive(time: float, speed: float) -> None:
        for _ in range(round(time / 0.05)):
            state = env.state()
            command = mpc.update(
                state, Intent(np.where(np.arange(len(mask)) == 0, speed, 0.0), mask, time=state.time)
            )
            env.plant.send(np.append(command.velocity(0.05), 0.0))

    drive(3.3, -0.12)
    drive(0.6, 0.0)
    before, ahead = client.body.contacts, []
    for _ in range(6):
        drive(1.0, 0.12)
        client.deaf = cut == "deaf"
        drive(seconds, 0.12) if client.deaf else client.sleep(seconds)
        client.deaf = False
        drive(0.1, 0.12)
        ahead.append(float(env.state().q[0] - client.body.base[0]))
    drive(2.0, 0.12)
    link.close()
    return ahead, client.body.contacts - before


@contextmanager
def wired(simulated=False, **more):
    """Yield a LeKiwi's socket of observations, and the link to it through LeRobot's own client."""
    zmq = pytest.importorskip("zmq", reason="pip install '.[lekiwi]'")
    with zmq.Context() as context, context.socket(zmq.PUSH) as says, context.socket(zmq.PULL) as takes:
        here = "tcp://127.0.0.1"
        ports = takes.bind_to_random_port(here), says.bind_to_random_port(here)
        says.linger = takes.linger = 0
        first = threading.Thread(
            target=says.send_json, args=({"_cams": [], **GOOD, **more},)
        )  # once somebody listens
        first.start()
        link = connect("lekiwi", ClientConfig("127.0.0.1", *ports, simulated=simulated), (), _MODEL, 50)
        first.join()
        yield says, link
        link.close()
