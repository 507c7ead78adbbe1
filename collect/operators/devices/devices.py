"""The devices by name: what an operator has in hand, and how a scripted person steers with it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from handrail.collect.operators.devices.input_map import InputMap, StickMap
from handrail.collect.operators.devices.leader_arm import LeaderArmMap
from handrail.collect.operators.devices.single_axis import SingleAxisMap
from handrail.collect.operators.human.steering import Gains
from handrail.collect.operators.modes import TeleopMode
from handrail.controllers.errors import unknown_name
from handrail.controllers.robot.model import RobotModel

_POSITION_ORDER = 0.25 / 0.35  # refractory time of a position device over a velocity stick's


@dataclass(frozen=True)
class Device:
    """What an operator has in hand; the numbers are a scripted person's, tuned on the same seeds for each.

    Attributes:
        build: its input map.
        gains: how briskly they steer.
        drives: whether they drive the base by itself from place to place, whatever the mode.
        refractory: their refractory time over that of a velocity stick.
    """

    build: Callable[[RobotModel, TeleopMode, Gains], InputMap]
    gains: Gains = field(default_factory=Gains)
    drives: bool = False
    refractory: float = 1.0


DEVICES: Mapping[str, Device] = {
    "sticks": Device(StickMap),
    "single_axis": Device(
        lambda model, mode, gains: SingleAxisMap(model, gains),
        Gains(gain=1.8, hand_speed=0.7, joint_rate=1.2, patience=4.0),
        drives=True,
    ),
    "leader_arm": Device(
        lambda model, mode, gains: LeaderArmMap(model, gains),
        Gains(gain=1.2, joint_rate=1.2),
        drives=True,
        refractory=_POSITION_ORDER,
    ),
}


def device_of(mode: TeleopMode) -> Device:
    """Return what the operator has in hand in a mode.

    Raises:
        HandrailError: there is no such device.
    """
    if mode.device not in DEVICES:
        raise unknown_name("device", mode.device, DEVICES)
    return DEVICES[mode.device]


def input_map(model: RobotModel, mode: TeleopMode) -> InputMap:
    """Return the input map of a mode."""
    device = device_of(mode)
    return device.build(model, mode, device.gains)
