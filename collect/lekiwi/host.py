"""A simulated LeKiwi on the network, in the protocol of LeRobot's own host.

Commands arrive at a PULL socket as JSON, the latest one wins. Observations leave a PUSH socket in several
parts: a JSON header with `_cams`, then one JPEG a camera (`lerobot/robots/lekiwi/lekiwi_host.py`).
"""

import json
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import NoReturn

from handrail.collect.lekiwi.body import LeKiwiBody
from handrail.collect.lekiwi.host_config import HostConfig
from handrail.collect.lekiwi.host_loop import LeKiwiLoop
from handrail.collect.processor.units import robot_units
from handrail.collect.world.env import HandrailEnv
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.errors import HandrailError, imported, message_of
from handrail.controllers.registry import resolved
from handrail.controllers.robot.description import load_description
from handrail.controllers.robot.model import load_model
from handrail.datasets.storage.atomic import explained
from handrail.datasets.storage.strict_json import write_json

_FPS = 60  # of the simulation [Hz]
_PERIOD = 1.0 / 30.0  # of a round, as LeRobot's host has it [s]


class HostSockets:
    """The two sockets of a host.

    Args:
        config: says where they are.
    """

    def __init__(self, config: HostConfig) -> None:
        zmq = imported("zmq", "handrail-lekiwi host", "pyzmq", "lekiwi")
        self._again, self._nowait = zmq.Again, zmq.NOBLOCK
        self._context = zmq.Context()
        self._commands = self._context.socket(zmq.PULL)
        self._commands.setsockopt(zmq.CONFLATE, 1)
        self._observations = self._context.socket(zmq.PUSH)
        self._observations.setsockopt(zmq.SNDHWM, 2)
        try:
            self._commands.bind(f"tcp://{config.address}:{config.port_zmq_cmd}")
            self._observations.bind(f"tcp://{config.address}:{config.port_zmq_observations}")
        except zmq.ZMQError as error:
            self.close()
            ports = f"{config.port_zmq_cmd}, {config.port_zmq_observations}"
            raise HandrailError(f"{config.address}, ports {ports}: {message_of(error)}") from error

    def receive(self) -> list[bytes]:
        """Return the newest command, if one has come."""
        try:
            return [self._commands.recv(self._nowait)]
        except self._again:
            return []

    def send(self, parts: list[bytes]) -> None:
        """Send an observation; while nobody takes it, it is forgotten."""
        with suppress(self._again):
            self._observations.send_multipart(parts, flags=self._nowait)

    def close(self) -> None:
        """Give the ports back; what nobody has taken is forgotten."""
        self._context.destroy(linger=0)


def serve(config: HostConfig, say: Callable[[str], None] = print) -> NoReturn:
    """Run the host until Ctrl-C."""
    model = load_model(config.robot)
    units = robot_units("lekiwi", model.description)
    expected = robot_units("lekiwi", load_description("lekiwi")).action_names
    if units.action_names != expected:
        raise HandrailError(f"--robot {config.robot}: expected a LeKiwi, with {', '.join(expected)}")
    task = resolved(TASKS.find(config.task).task)()
    render = "rgb_array" if config.cameras else None
    env = HandrailEnv(task, model, fps=_FPS, render_mode=render)
    body, sockets = LeKiwiBody(env, units), HostSockets(config)
    loop = LeKiwiLoop(body, config, time.monotonic())
    say(
        f"LeKiwi (simulated): commands {config.address}:{config.port_zmq_cmd}, "
        f"observations :{config.port_zmq_observations}; Ctrl-C ends it"
    )
    try:
        while True:
            now = time.monotonic()
            if parts := loop.tick(now, sockets.receive(), time.time()):
                sockets.send(parts)
            time.sleep(max(_PERIOD - (time.monotonic() - now), 0.0))
    finally:
        sockets.close()
        env.close()
        summary = loop.summary()
        say(json.dumps({name: value for name, value in summary.items() if name != "episodes"}))
        if config.json:
            with explained(f"--json {config.json}"):
                write_json(Path(config.json).expanduser(), summary)
