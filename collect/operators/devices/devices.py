"""The devices by name: what an operator has in hand, and how a scripted person steers with it."""

from dataclasses import dataclass, field

from handrail.collect.operators.devices.input_map import InputMap, StickMap
from handrail.collect.operators.devices.leader_arm import LeaderArmMap
from handrail.collect.operators.devices.single_axis import SingleAxisMap
from handrail.collect.operators.human.steering import Gains
from handrail.controllers.registry import Registry

_POSITION_ORDER = 0.25 / 0.35  # refractory time of a position device over a velocity stick's


@dataclass(frozen=True)
class Device:
    """What an operator has in hand; the numbers are a scripted person's, tuned on the same seeds for each.

    Attributes:
        name: as a mode names it.
        help: one line.
        build: its input map.
        gains: how briskly they steer.
        drives: whether they drive the base by itself from place to place, whatever the mode.
        refractory: their refractory time over that of a velocity stick.
    """

    name: str
    help: str
    build: type[InputMap]
    gains: Gains = field(default_factory=Gains)
    drives: bool = False
    refractory: float = 1.0


DEVICES = Registry(
    "device",
    Device,
    (
        Device("sticks", "velocity sticks on all channels of a mode", StickMap),
        Device(
            "single_axis",
            "one stick, one axis at a time",
            SingleAxisMap,
            Gains(gain=1.8, hand_speed=0.7, joint_rate=1.2, patience=4.0),
            drives=True,
        ),
        Device(
            "leader_arm",
            "a small copy of the arm, and a stick for the base",
            LeaderArmMap,
            refractory=_POSITION_ORDER,
        ),
    ),
)
