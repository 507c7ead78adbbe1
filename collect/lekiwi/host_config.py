"""Settings of the simulated LeKiwi; light to import."""

from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from handrail.collect.client_config import CLIENTS, Port
from handrail.collect.flags import check_file, names, one_of
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.errors import HandrailError, check_known
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.typed import check_settings
from handrail.datasets.advanced import Advanced
from handrail.datasets.lists import Names

_CAMERAS = CLIENTS["lekiwi"]


@dataclass(frozen=True)
class HostConfig:
    """Simulate a LeKiwi on the network: LeRobot's own LeKiwiClient drives it as it drives a real one."""

    task: Annotated[str, one_of(TASKS)] = "reach"
    """The task; its scene stands around the robot."""
    robot: Annotated[str, one_of(ROBOTS)] = "lekiwi"
    """A LeKiwi, or its description file (.toml)."""
    seed: Annotated[int, Meta(ge=0, le=2**53 - 1)] = 0
    """Seed of the scene, until a client of Handrail's asks for another one; and of what gets lost."""
    address: str = "127.0.0.1"
    """Where it listens; * for everybody in the network."""
    port_zmq_cmd: Port = 5555
    """Where commands arrive."""
    port_zmq_observations: Port = 5556
    """Where observations leave."""
    cameras: Names = ""
    """Its cameras: front, wrist or both; none by default (needs OpenGL)."""
    latency: Advanced[Annotated[float, Meta(ge=0, le=2)]] = 0.0
    """How late commands and observations arrive, each [s]."""
    drop: Advanced[Annotated[float, Meta(ge=0, le=1)]] = 0.0
    """Share of the messages that get lost, 0 to 1."""
    lost_camera: Advanced[str] = ""
    """A camera that says nothing."""
    json: Advanced[str] = ""
    """Write what it saw to this file at the end: commands, ages, stops, episodes."""

    @property
    def camera_names(self) -> tuple[str, ...]:
        """The cameras asked for."""
        return names(self.cameras, _CAMERAS)

    def check(self) -> None:
        """Check the settings."""
        TASKS.check(self.task)
        check_known("camera", filter(None, (*self.camera_names, self.lost_camera)), _CAMERAS)
        check_settings(self, "--")
        if self.port_zmq_cmd == self.port_zmq_observations:
            raise HandrailError("--port_zmq_cmd and --port_zmq_observations: expected two ports, got one")
        check_file("--json", self.json)
