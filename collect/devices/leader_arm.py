"""A leader arm, or any LeRobot teleoperator that says joint positions."""

import contextlib
import importlib
import math
import pkgutil
import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from handrail.collect.devices.device import DeviceInput
from handrail.collect.processor.units import number
from handrail.collect.teleop_config import LeaderConfig
from handrail.controllers.errors import HandrailError, check_known, message_of, restated

if TYPE_CHECKING:
    from lerobot.teleoperators.teleoperator import Teleoperator

_PERIOD = 0.004  # between two readings [s]
_GONE = 1.0  # without a good reading, it is gone [s]
_MOST_STEP = 0.25  # of a joint between two readings, as a share of half a turn
_HALF_TURN = 180.0  # in degrees; a range of −100 to 100 is about as much


class LeaderArm:
    """Reads the joint positions of a LeRobot teleoperator; a device.

    A reading that is not whole, not finite, or a jump that no hand makes is dropped: the one before gets
    older instead, and whoever is too old does not steer.

    Args:
        make: makes LeRobot's teleoperator, not connected.
        name: what the data call it: LeRobot's type.
        sources: names of the positions that are needed.
        clock: of readings [s].
    """

    def __init__(
        self,
        make: "Callable[[], Teleoperator]",
        name: str,
        sources: tuple[str, ...],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.name, self._make, self._sources, self._clock = name, make, sources, clock
        self._teleoperator: Teleoperator | None = None
        self._last = DeviceInput(-math.inf)

    def open(self) -> None:
        """Connect it."""
        self._teleoperator = connected(self._make(), self.name)
        self._last = DeviceInput(self._clock(), attended=False)

    def read(self) -> DeviceInput:
        """Return its joint positions."""
        assert self._teleoperator is not None
        time.sleep(_PERIOD)
        try:
            said, trouble = self._teleoperator.get_action(), "its readings make no sense"
        except Exception as error:  # whatever a driver's code raises
            said, trouble = None, message_of(error)
        now, joints = self._clock(), {name: number(said, name) for name in self._sources}
        if self._makes_sense(joints, now):
            self._last = DeviceInput(now, joints=joints)
        elif now - self._last.time > _GONE or not self._teleoperator.is_connected:
            raise ConnectionError(trouble)
        return self._last

    def close(self) -> None:
        """Let it go; the port, too, which LeRobot leaves open where the motors no longer answer."""
        arm, self._teleoperator = self._teleoperator, None
        try:
            if arm is not None and arm.is_connected:
                arm.disconnect()
        finally:
            for each in (arm, getattr(arm, "left_arm", None), getattr(arm, "right_arm", None)):
                port = getattr(getattr(each, "bus", None), "port_handler", None)
                if port is not None and getattr(port, "is_open", False):
                    port.closePort()

    def _makes_sense(self, joints: Mapping[str, float], now: float) -> bool:
        """Whether all is finite, and a hand can have moved it so since; after a long time, it can."""
        before = self._last.joints if now - self._last.time <= _GONE / 2 else {}
        return all(
            math.isfinite(place) and abs(place - before.get(name, place)) < _MOST_STEP * _HALF_TURN
            for name, place in joints.items()
        )


def connected(teleoperator: "Teleoperator", name: str, calibrate: bool = False) -> "Teleoperator":
    """Return a teleoperator that is connected and calibrated.

    Args:
        teleoperator: LeRobot's.
        name: its type.
        calibrate: let LeRobot calibrate it where it is not: it asks in the terminal.
    """
    try:
        teleoperator.connect(calibrate=calibrate)
        calibrated = teleoperator.is_calibrated
    except Exception as error:  # whatever a driver's code raises
        words, advice = message_of(error), "check --teleop.port (lerobot-find-port), cable and power"
        if "ermission" in words or isinstance(error, PermissionError):
            advice = "add yourself to its group (sudo usermod -aG dialout $USER), log in again"
        raise HandrailError(f"{name}: cannot be connected: {words}; {advice}") from error
    if not calibrated:
        teleoperator.disconnect()
        raise HandrailError(
            f"{name}: not calibrated; run lerobot-calibrate with the same --teleop.type, "
            "--teleop.port and --teleop.id once"
        )
    return teleoperator


def make_teleoperator(config: LeaderConfig) -> "Teleoperator":
    """Return LeRobot's teleoperator of the settings, not connected.

    Also of installed packages whose names begin with `lerobot_teleoperator_`.
    """
    import draccus
    from lerobot.teleoperators.utils import make_teleoperator_from_config

    known = leader_types()
    check_known("--teleop.type", (config.type,), known)
    options = [option.strip() for option in config.options.split(",") if option.strip()]
    if not all("=" in option for option in options):
        raise HandrailError(
            f"--teleop.type {config.type}: options {config.options}: expected name=value with commas"
        )
    given = {name: value for name, value in (("port", config.port), ("id", config.id)) if value}
    given |= dict(option.split("=", 1) for option in options)
    with restated(f"--teleop.type {config.type}"):  # whatever a driver's code raises
        return make_teleoperator_from_config(draccus.decode(known[config.type], given))


def leader_types() -> Mapping[str, Any]:
    """Return the settings of every type of LeRobot's teleoperators, by its name."""
    from lerobot import teleoperators
    from lerobot.utils.import_utils import register_third_party_plugins

    for module in pkgutil.iter_modules(teleoperators.__path__):
        with contextlib.suppress(ImportError):  # of a driver that is not installed
            importlib.import_module(f"lerobot.teleoperators.{module.name}")
    register_third_party_plugins()
    known = teleoperators.TeleoperatorConfig.get_known_choices()
    return {name: each for name, each in known.items() if not name.startswith("handrail_")}
