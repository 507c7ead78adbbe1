"""Settings of the simulated LeKiwi; light to import."""

from dataclasses import dataclass
from typing import Annotated

from handrail.collect.flags import check_json, names, one_of
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.errors import HandrailError, unknown_name
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.datasets.advanced import Advanced
from handrail.datasets.lists import Names

_CAMERAS = ("front", "wrist")


@dataclass(frozen=True)
class HostConfig:
    """Simulate a LeKiwi on the network: LeRobot's own LeKiwiClient drives it as it drives a real one."""

    task: Annotated[str, one_of(TASKS)] = "reach"
    """What stands around it."""
    robot: Annotated[str, one_of(ROBOTS)] = "lekiwi"
    """A LeKiwi, or its description file (.toml)."""
    seed: int = 0
    """Of the scene, until a client of Handrail's asks for another one; and of what gets lost."""
    address: str = "127.0.0.1"
    """Where it listens; * for everybody in the network."""
    port_zmq_cmd: int = 5555
    """Where commands arrive."""
    port_zmq_observations: int = 5556
    """Where observations leave."""
    cameras: Names = ""
    """What it sees: front, wrist or both; none by default (needs OpenGL)."""
    camera_fps: Advanced[float] = 10.0
    """New pictures a second; in between it sends the last one again."""
    watchdog_timeout_ms: Advanced[float] = 500.0
    """Without a command for so long, the base stops."""
    max_loop_freq_hz: Advanced[float] = 30.0
    """Rounds a second."""
    latency: Advanced[float] = 0.0
    """How late commands and observations arrive, each [s]."""
    drop: Advanced[float] = 0.0
    """Share of the messages that get lost, 0 to 1."""
    lost_camera: Advanced[str] = ""
    """A camera that says nothing."""
    seconds: float = 0.0
    """How long it runs; until Ctrl-C when 0."""
    json: Advanced[str] = ""
    """Write what it saw to this file at the end: commands, ages, stops, episodes."""

    @property
    def camera_names(self) -> tuple[str, ...]:
        """The cameras asked for."""
        return names(self.cameras, _CAMERAS)

    def check(self) -> None:
        """Check the settings."""
        TASKS.check(self.task)
        for camera in filter(None, (*self.camera_names, self.lost_camera)):
            if camera not in _CAMERAS:
                raise unknown_name("camera", camera, _CAMERAS)
        ranges = (
            ("port_zmq_cmd", 1, 65535), ("port_zmq_observations", 1, 65535), ("seed", 0, 2**53 - 1),
            ("camera_fps", 0.1, 60), ("watchdog_timeout_ms", 50, 10_000), ("max_loop_freq_hz", 5, 60),
            ("latency", 0, 2), ("drop", 0, 1), ("seconds", 0, 1e6),
        )  # fmt: skip
        for name, low, high in ranges:
            if not low <= getattr(self, name) <= high:
                raise HandrailError(f"--{name} {getattr(self, name)}: expected {low} to {high}")
        if self.port_zmq_cmd == self.port_zmq_observations:
            raise HandrailError("--port_zmq_cmd and --port_zmq_observations: expected two ports, got one")
        check_json(self.json)
