"""The link to a robot through its LeRobot client: one command out and one observation in, a period."""

import contextlib
import logging
import math
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handrail.collect.client_config import CLIENTS, ClientConfig
from handrail.collect.clock import time_with_sleep
from handrail.collect.flags import check_names
from handrail.collect.lekiwi.host_loop import EPISODE, SEED, SENT
from handrail.collect.operators.operator import EpisodeEvent
from handrail.collect.processor.units import robot_units
from handrail.collect.processor.whole_body import WholeBody
from handrail.controllers.errors import HandrailError, imported, restated
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import DEAD_MAN_TIME
from handrail.controllers.robot.model import RobotModel

_BACKLOG = 1000  # observations that may have waited
_LATE = 1.5  # periods after a command, from which the next one is late
_MOST_BRAKING = 200  # periods
_GONE = 2.0  # without a usable observation for so long, the robot is gone [s]
_log = logging.getLogger(__name__)


class Link:
    """Keeps the beat: a command is sent, the period passes, the robot is heard.

    A LeKiwi goes on as it was told last, for half a second. So every command is sent twice, half a period
    apart: one lost message does not make it go on. And while the next command is late, a thread sends it the
    full stop, period by period.

    Args:
        client: a robot of LeRobot's, not connected.
        name: of the robot.
        model: of the robot.
        period: from one command to the next [s].
        simulated: whether it is our simulation, which is told what episode it is.
        clock: [s].
        sleep: waits [s].

    Attributes:
        body: what is known of the robot.
        state: of the robot; its time stands still while nothing usable is heard.
        late: periods in which it was sent the full stop because the next command was late.
        asked: says, while it goes to where an episode begins, PAUSE to brake, QUIT to stay where it is.
    """

    state: State

    def __init__(
        self,
        client: Any,
        name: str,
        model: RobotModel,
        period: float,
        simulated: bool = False,
        clock: Callable[[], float] = time_with_sleep,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._client, self._name, self.model, self.period = client, name, model, period
        self._simulated, self._clock, self._sleep = simulated, clock, sleep
        units = robot_units(name, model.description)
        if set(client.action_features) != set(units.action_names):
            raise HandrailError(
                f"--robot_client {name}: expected a robot with {', '.join(client.action_features)}; "
                f"got {model.description.name} (--robot {name}?)"
            )
        self.body = WholeBody(model, units, period)
        self._said: Mapping[str, Any] = {}
        self._due, self.late = math.inf, 0
        self.asked: Callable[[], EpisodeEvent | None] = lambda: None
        self._lock, self._closed = threading.Lock(), threading.Event()
        self._episode, self._seed = int(time.time()), 0  # another recorder's differ
        with restated(f"--robot_client {name}: cannot be reached"):
            client.connect()
        self._heard = self._deadline = clock()
        try:
            self._catch_up()
        except BaseException:
            client.disconnect()
            raise
        threading.Thread(target=self._watch, daemon=True).start()

    def begin(self, seed: int) -> None:
        """Begin an episode; our own simulation is told which, in every command, until it has heard."""
        self._episode, self._seed = self._episode + 1, seed
        self._catch_up()
        self._deadline = self._heard = self._clock()

    def exchange(self, command: ArrayLike) -> NDArray[np.floating]:
        """Send a command, wait for the end of the period, and listen; return what was sent, (n + 1,)."""
        late = self._clock() - self._deadline > DEAD_MAN_TIME
        with restated(f"robot {self._name}: cannot be reached"), self._lock:
            self._send(command)
        sent = self.body.sent
        self._wait(0.5)
        with restated(f"robot {self._name}: cannot be reached"), self._lock:
            if self._clock() <= self._due:  # else the robot may stand meanwhile
                self._client.send_action(self._action)
        self._wait(0.5)
        self._catch_up() if late else self._listen()
        return sent

    def stop(self) -> None:
        """Brake until it was sent rest, whether or not it is heard."""
        for _ in range(_MOST_BRAKING):
            if not self.body.velocity.any():
                return
            with contextlib.suppress(HandrailError):
                self.exchange(())

    def brake_if_late(self) -> None:
        """Send the robot a period of the full stop, if the command after the last one is late."""
        with self._lock:
            if self._clock() > self._due and self.body.velocity.any():
                self.body.pass_time(self._clock())
                self._send((), 1.0)
                self.late += 1

    def pictures(self, cameras: tuple[str, ...], size: tuple[int, int]) -> dict[str, NDArray[np.uint8]]:
        """Return what its cameras see, (height, width, 3), in a size (height, width)."""
        import cv2

        seen: dict[str, Any] = {}
        for camera in cameras:
            if camera not in self._said:
                raise HandrailError(f"robot {self._name}: camera {camera} says nothing; look at its cable")
            picture = np.asarray(self._said[camera])  # RGB, as LeRobot's camera said it
            seen[camera] = cv2.resize(picture, size[::-1], interpolation=cv2.INTER_AREA)
        return seen

    def close(self) -> None:
        """Brake, and let it go; its own watchdog stops what still moves."""
        self.stop()
        self._closed.set()
        with self._lock:
            self._client.disconnect()
        if self.late:
            _log.warning("robot %s: commands were late; it braked for %d periods", self._name, self.late)

    def _send(self, command: ArrayLike, late: float = _LATE) -> None:
        """Send a command; the next one is late after so many periods."""
        self._action = self.body.send(command)
        if self._simulated:
            self._action |= {EPISODE: self._episode, SEED: self._seed, SENT: time.time()}
        self._client.send_action(self._action)
        self._due = self._clock() + late * self.period

    def _watch(self) -> None:
        """Brake while commands are late; what a driver's code raises here, it raises in the loop as well."""
        while not self._closed.wait(0.5 * self.period):
            with contextlib.suppress(Exception):
                self.brake_if_late()

    def _wait(self, periods: float) -> None:
        self._deadline += periods * self.period
        ahead = self._deadline - self._clock()
        if ahead > 0.0:
            self._sleep(ahead)
        elif -ahead > self.period:
            self._deadline = self._clock()

    def _catch_up(self) -> None:
        """Hear what was said while nobody listened: the network keeps it, and hands it on bit by bit."""
        for _ in range(_BACKLOG):
            before = self._said
            self._listen()
            if self._said is before:
                return

    def _listen(self) -> None:
        with restated(f"robot {self._name}: cannot be heard"):
            said = self._client.get_observation()
        now = self._clock()
        with self._lock:
            state = self.body.observe(said, now)
        if not self.body.trouble:
            self.state, self._said, self._heard = state, said, now
            return
        self.state = replace(state, time=self.state.time)  # it knows what was sent; its clock stands
        if now - self._heard > _GONE:
            raise HandrailError(f"robot {self._name}: nothing usable heard for {_GONE:.0f} s; is it on?")


def connect(
    robot: str, config: ClientConfig, cameras: tuple[str, ...], model: RobotModel, fps: float
) -> Link:
    """Return the link to a robot.

    Args:
        robot: which one.
        config: where it is.
        cameras: that it shall show.
        model: of the robot.
        fps: commands a second.
    """
    imported("zmq", f"--robot_client {robot}", "pyzmq", "lekiwi")
    from lerobot.robots.lekiwi import LeKiwiClient, LeKiwiClientConfig
    from lerobot.robots.lekiwi.config_lekiwi import lekiwi_cameras_config

    if cameras:
        check_names("camera", f"--robot_client {robot}: --cameras", cameras, CLIENTS[robot])
    settings = LeKiwiClientConfig(
        remote_ip=config.remote_ip,
        port_zmq_cmd=config.port_zmq_cmd,
        port_zmq_observations=config.port_zmq_observations,
        cameras={name: camera for name, camera in lekiwi_cameras_config().items() if name in cameras},
        polling_timeout_ms=min(15, round(250.0 / fps)),  # or the next command is late
    )

    class WholeClient(LeKiwiClient):
        """Says NaN of what a message lacks, where LeRobot's says 0.0; is let go when its robot is gone."""

        def connect(self) -> None:
            super().connect()
            sockets: tuple[Any, ...] = self.zmq_cmd_socket, self.zmq_observation_socket
            for each in sockets:
                each.linger = 500  # without it, letting go waits until the last command is taken [ms]

        def _parse_observation(self, frames: list[bytes]) -> dict[str, Any] | None:
            unsaid = dict.fromkeys(self._state_order, math.nan)
            with contextlib.suppress(AttributeError, TypeError):  # of JSON that is no table
                said = unsaid | super()._parse_observation(frames)  # pyright: ignore[reportOperatorIssue]
                if config.simulated and EPISODE not in said:
                    raise HandrailError("--client.simulated: expected handrail-lekiwi host, got a robot")
                return said

    client: Any = WholeClient(settings)
    try:
        return Link(client, robot, model, 1.0 / fps, config.simulated)
    except BaseException:
        if not client.is_connected and client.zmq_context is not None:  # LeRobot leaves its sockets open
            client.zmq_context.destroy(linger=0)
        raise
