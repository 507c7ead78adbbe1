"""The devices at this computer: which can be driven with, and what one says."""

import math
import time
from pathlib import Path

from handrail.collect.devices.device import Device, DeviceInput, StickShape
from handrail.collect.devices.device_reader import DeviceReader
from handrail.collect.devices.gamepad import Gamepad
from handrail.collect.devices.keyboard import Keyboard
from handrail.collect.devices.leader_arm import LeaderArm, leader_types, make_teleoperator
from handrail.collect.devices.spacemouse import SpaceMouse
from handrail.collect.teleop_config import LEADER, ListDevicesConfig, ShowDeviceConfig
from handrail.controllers.errors import message_of
from handrail.datasets.presentation.table import Table
from handrail.datasets.presentation.terminal import Terminal

_PERIOD = 0.1  # between two lines [s]
_PORTS = ("ttyACM*", "ttyUSB*")


def list_devices(config: ListDevicesConfig) -> int:
    """Print a table of the devices; return the exit code."""
    del config
    rows = [(device.name, _state(device)) for device in (Gamepad(), SpaceMouse(), Keyboard())]
    ports = sorted(str(path) for pattern in _PORTS for path in Path("/dev").glob(pattern))
    rows.append((LEADER, f"serial ports: {', '.join(ports) or 'none'}; types: {', '.join(leader_types())}"))
    Terminal().print(Table(("--operator", "state"), rows))
    return 0


def _state(device: Device) -> str:
    """Return whether a device can be opened, else what to do."""
    try:
        device.open()
    except Exception as error:  # whatever a driver's code raises
        return message_of(error).removeprefix(f"{device.name}: ")
    finally:
        device.close()
    return "ready"


def show_device(config: ShowDeviceConfig) -> int:
    """Print what a device says, line by line; return the exit code."""
    poller, say = DeviceReader(_device(config)).start(), Terminal().print
    try:
        for _ in range(math.ceil(config.seconds / _PERIOD)) if config.seconds else iter(int, 1):
            reading, presses = poller.take()
            say(_line(reading, presses) if reading else poller.trouble)
            time.sleep(_PERIOD)
    finally:
        poller.close()
    return 0


def _device(config: ShowDeviceConfig) -> Device:
    teleop = config.teleop
    shape = StickShape(teleop.dead_zone, teleop.exponent)
    if config.device == "keyboard":
        return Keyboard()
    if config.device == LEADER:
        sources = tuple(make_teleoperator(teleop).action_features)
        return LeaderArm(lambda: make_teleoperator(teleop), teleop.type, sources)
    return {"gamepad": Gamepad, "spacemouse": SpaceMouse}[config.device](shape)


def _line(reading: DeviceInput, presses: tuple[str, ...]) -> str:
    values = {**reading.deflections, **reading.joints}
    said = [f"{name} {value:+.2f}" for name, value in values.items()]
    return ", ".join([*said, *(f"{name} pressed" for name in presses)]) or "at rest"
