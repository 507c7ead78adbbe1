"""Which input map belongs to which device."""

from collections.abc import Callable, Mapping

from handrail.collect.operators.devices.input_map import InputMap, StickMap
from handrail.collect.operators.devices.leader_arm import LeaderArmMap
from handrail.collect.operators.devices.single_axis import SingleAxisMap
from handrail.collect.operators.human.steering import Gains
from handrail.collect.operators.modes import Device, TeleopMode
from handrail.controllers.robot.model import RobotModel

DEVICES: Mapping[Device, Callable[[RobotModel, TeleopMode, Gains], InputMap]] = {
    "sticks": StickMap,
    "single_axis": lambda model, mode, gains: SingleAxisMap(model, gains),
    "leader_arm": lambda model, mode, gains: LeaderArmMap(model, gains),
}


def input_map(model: RobotModel, mode: TeleopMode) -> InputMap:
    """Return the input map of a mode."""
    return DEVICES[mode.device](model, mode, mode.gains)
