"""From what a teleoperator says to an intent: the channels that it names are owned, the rest is completed."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from handrail.collect.processor.units import RobotUnits, number
from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import check_known
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.frames import Frames
from handrail.controllers.interface.intent import Intent

_ACTIONS = {0.0: 1.0, 1.0: None, 2.0: 0.0}  # LeRobot's gripper actions: close, stay, open
_FOLLOW = 4.0  # of a joint towards the position that is asked for [1/s]


class PartialIntent:
    """Reads actions.

    An entry is one of
    - a channel (`ee.vx`, `base.wz`, `joint.elbow_flex`), in m/s and rad/s;
    - a name of `inputs`: so many times a channel, whatever else the name means;
    - an entry of the robot's own action: a leader's joint, which is followed, or a velocity of a joint that
      takes one or of the base;
    - `gripper`, of several hands `left.gripper`: 0 open to 1 closed, or LeRobot's action: 0 closes, 1 leaves
      it, 2 opens;
    - `time`, when it was asked, on the clock of the step [s].

    Args:
        channels: of the robot.
        units: of the robot.
        inputs: by name of an entry, the channel and how much of it one unit is.
        frames: in which twists are meant.
        actions: whether `gripper` is an action of LeRobot's.
    """

    def __init__(
        self,
        channels: Channels,
        units: RobotUnits,
        inputs: Mapping[str, tuple[str, float]],
        frames: Frames,
        actions: bool = False,
    ) -> None:
        self._channels, self._units, self._frames, self._actions = channels, units, frames, actions
        self._scaled = {name: (index, 1.0) for index, name in enumerate(channels.names)}
        if units.base:
            self._scaled |= zip(units.base.twist, enumerate(units.base.scale), strict=True)
        self._first_arm = first = channels.joint_slice.start + len(channels.base)
        arm = zip(units.action_names, enumerate(units.scale, first), units.sends_position, strict=False)
        self._scaled |= {name: term for name, term, is_position in arm if not is_position}
        for name, (channel, scale) in inputs.items():
            check_known(f"channel of input {name}:", (channel,), channels.names)
            self._scaled[name] = (channels.names.index(channel), scale)
        self._of_robot = {each.name: (hand, each) for hand, each in enumerate(units.grippers) if each}

    def read(self, action: Any, targets: FloatArray, closed: FloatArray, now: float) -> Intent:
        """Return the intent of an action; one that is malformed says so by numbers that are none.

        Args:
            action: of a teleoperator.
            targets: where the arm's joints are sent now, (n − b,).
            closed: how far each gripper is to be closed if the action does not say it, (h,).
            now: the time of an action that says none [s].
        """
        values, mask = np.zeros(self._channels.size), np.zeros(self._channels.size, dtype=bool)
        entries = action if isinstance(action, Mapping) else {"": math.nan}
        units, stamp, grips = self._units, now, closed.tolist()
        for name in entries:
            value = number(entries, name)
            if name in self._scaled:
                index, scale = self._scaled[name]
                values[index] += scale * value
                mask[index] = True
            elif name == "time":
                stamp = value
            elif name in self._channels.grippers:
                hand = self._channels.grippers.index(name)
                grip = _ACTIONS.get(value, math.nan) if self._actions else value
                grips[hand] = grips[hand] if grip is None else grip
            elif name in units.positions:
                joint = units.positions.index(name)
                wanted = units.joint_positions(np.where(np.arange(len(targets)) == joint, value, 0.0))
                values[self._first_arm + joint] += _FOLLOW * (wanted[joint] - targets[joint])
                mask[self._first_arm + joint] = True
            elif name in self._of_robot:
                hand, gripper = self._of_robot[name]
                grips[hand] = gripper.closing(value)
            else:
                values[:], mask[:] = math.nan, True
        return Intent(values, mask, tuple(grips), "processor", stamp, self._frames)
