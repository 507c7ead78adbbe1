"""Which robot of LeRobot's is driven instead of a simulation, as typed settings; light to import."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from handrail.controllers.errors import HandrailError, check_known
from handrail.controllers.typed import check_settings

CLIENTS: Mapping[str, tuple[str, ...]] = {"lekiwi": ("front", "wrist")}  # the robots, and their cameras
Port = Annotated[int, Meta(ge=1, le=65535)]
NO_SCREEN = "browser"  # it draws a simulation


@dataclass(frozen=True)
class ClientConfig:
    """Where the robot is; the flags are LeRobot's."""

    remote_ip: str = "127.0.0.1"
    """The robot computer's address."""
    port_zmq_cmd: Port = 5555
    """Where it takes commands."""
    port_zmq_observations: Port = 5556
    """Where it sends observations."""
    simulated: bool = False
    """It is handrail-lekiwi host: let it begin every episode anew, in the episode's own scene."""

    def check(self, robot: str, operator: str) -> None:
        """Check the settings.

        Args:
            robot: which one; empty where a simulation is driven.
            operator: who steers.
        """
        if not robot:
            if self != ClientConfig():
                raise HandrailError("--client.*: expected --robot_client too, got none")
            return
        check_known("--robot_client", (robot,), CLIENTS)
        if operator == NO_SCREEN:
            raise HandrailError(f"--robot_client {robot}: expected another --operator than {NO_SCREEN}")
        check_settings(self, "--client.")
