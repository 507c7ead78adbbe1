"""What a robot of LeRobot's calls its joints, and in which units: from its numbers to ours, and back."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError, unknown_name
from handrail.controllers.robot.description import RobotDescription
from handrail.controllers.typed import Number, Text, decoded

POSITION, VELOCITY = ".pos", ".vel"
_DEGREE = math.pi / 180.0
_OPEN = 35.0  # percent of the jaw's range, −0.17 to 1.75 rad: where the model of the SO-101 is open, 0.5 rad
_SENT = {"position": POSITION, "velocity": VELOCITY}


@dataclass(frozen=True)
class JointUnits:
    """A joint of the arm: `q = q₀ + sign · s · (value − zero)`."""

    name: Text
    """Of its entries, without `.pos` and `.vel`."""
    unit: Literal["degrees", "radians", "metres", "range"] = "degrees"
    """`q₀ = 0`; but with range, the values are −100 to 100 between the joint's limits."""
    sign: Literal[1, -1] = 1
    """−1 where it turns the other way."""
    zero: Number = 0.0
    """The value at `q₀`."""
    sends: Literal["position", "velocity"] = "position"
    """What the robot takes."""


@dataclass(frozen=True)
class BaseUnits:
    """The base: velocities in its own frame [m/s, unit/s]; and its pose, where the robot has odometry."""

    x: Text = "x.vel"
    """Name of the velocity ahead."""
    y: Text = "y.vel"
    """Name of the velocity to the left."""
    theta: Text = "theta.vel"
    """Name of the velocity of the turn."""
    unit: Literal["degrees", "radians"] = "degrees"
    """Of the turn."""
    pose: tuple[Text, ...] = ()
    """Names of x, y and heading in the world [m, unit]; none where they are to be integrated."""


@dataclass(frozen=True)
class GripperUnits:
    """The gripper: its name, and its values when it is open and closed."""

    name: Text
    opened: Number
    closed: Number


class BodyReading(NamedTuple):
    """What an observation says [m, rad]: joints, (n − b,); the base's twist and pose, (3,); opening."""

    arm: FloatArray
    twist: FloatArray
    pose: FloatArray | None
    opening: float


class RobotUnits:
    """Names and units of a whole robot.

    Args:
        description: of the robot.
        joints: of the arm, by the description's names.
        base: of the base; None on a fixed one.
        gripper: None where there is none.

    Attributes:
        action_names: of the action's entries, in order.
        sends_position: which joints of the arm are sent positions, (n − b,).
    """

    def __init__(
        self,
        description: RobotDescription,
        joints: Mapping[str, JointUnits],
        base: BaseUnits | None,
        gripper: GripperUnits | None,
    ) -> None:
        arm = description.arm_joints
        if set(joints) != set(arm) or bool(base) != bool(description.base.joints):
            raise HandrailError(
                f"units of robot {description.name}: expected joints {', '.join(arm)} and "
                f"{'a' if description.base.joints else 'no'} base; got {', '.join(joints) or 'no joints'} "
                f"and {'a' if base else 'no'} base"
            )
        self.base, self.gripper = base, gripper
        self._joints = [joints[name] for name in arm]
        offset = len(description.base.joints)
        lower, upper = (
            limit[offset:] for limit in (description.limits.position_lower, description.limits.position_upper)
        )
        terms = [_terms(joint, *ends) for joint, *ends in zip(self._joints, lower, upper, strict=True)]
        self._scale, self._centre = np.array(terms).reshape(-1, 2).T
        self._zero = np.array([joint.zero for joint in self._joints])
        self.sends_position = np.array([joint.sends == "position" for joint in self._joints], dtype=bool)
        self.turn = _angle(base.unit) if base else 1.0
        self.positions = tuple(joint.name + POSITION for joint in self._joints)
        grip = (gripper.name,) if gripper else ()
        twist = (base.x, base.y, base.theta) if base else ()
        self.action_names = (*(joint.name + _SENT[joint.sends] for joint in self._joints), *grip, *twist)

    @property
    def observation_names(self) -> tuple[str, ...]:
        """Names of the numbers that an observation has to have."""
        base = (self.base.pose or (self.base.x, self.base.y, self.base.theta)) if self.base else ()
        return (*self.positions, *((self.gripper.name,) if self.gripper else ()), *base)

    def read(self, observation: Any) -> BodyReading | None:
        """Return what an observation says; None where a number is missing or not finite."""
        values = {name: number(observation, name) for name in self.observation_names}
        if not all(map(math.isfinite, values.values())):
            return None
        arm = self.joint_positions(np.array([values[name] for name in self.positions]))
        twist, pose = np.zeros(3), None
        if self.base is not None:
            rad = np.array([1.0, 1.0, self.turn])
            named = (self.base.x, self.base.y, self.base.theta)
            if self.base.pose:
                pose = rad * [values[name] for name in self.base.pose]
            else:
                twist = rad * [values[name] for name in named]
        grip = self.gripper
        opening = 1.0 - self.grip(values[grip.name]) if grip else 0.0
        return BodyReading(arm, twist, pose, opening)

    def action(self, q: FloatArray, v: FloatArray, twist: FloatArray, gripper: float) -> dict[str, float]:
        """Return the robot's action.

        Args:
            q: where the arm's joints shall be, (n − b,).
            v: how fast they shall move, (n − b,).
            twist: of the base in its own frame [m/s, rad/s], (3,).
            gripper: 0 open, 1 closed.
        """
        values = np.where(self.sends_position, (q - self._centre) / self._scale + self._zero, v / self._scale)
        numbers = values.tolist()
        if self.gripper:
            numbers.append(self.gripper.opened + gripper * (self.gripper.closed - self.gripper.opened))
        if self.base:
            numbers += (twist / [1.0, 1.0, self.turn]).tolist()
        return dict(zip(self.action_names, map(float, numbers), strict=True))

    def joint_positions(self, values: FloatArray) -> FloatArray:
        """Return the arm's joints from the robot's values, (n − b,) [m, rad]."""
        return self._centre + self._scale * (values - self._zero)

    def grip(self, value: float) -> float:
        """Return how far the gripper is closed, from 0 to 1."""
        assert self.gripper is not None
        share = (value - self.gripper.opened) / (self.gripper.closed - self.gripper.opened)
        return min(max(share, 0.0), 1.0) if math.isfinite(share) else share


def number(values: Any, name: str) -> float:
    """Return the number of a name; NaN where there is none, or something else."""
    try:
        return float(values[name])
    except (KeyError, TypeError, ValueError, OverflowError, RuntimeError):  # torch raises the last
        return math.nan


def lekiwi(description: RobotDescription) -> RobotUnits:
    """Return what LeRobot's LeKiwi says: degrees, percents of the jaw, and the base's velocities."""
    joints = {name: JointUnits(f"arm_{name}") for name in description.arm_joints}
    return RobotUnits(description, joints, BaseUnits(), GripperUnits("arm_gripper.pos", _OPEN, 0.0))


def so_follower(description: RobotDescription) -> RobotUnits:
    """Return what LeRobot's SO-100 and SO-101 say: degrees, and percents of the jaw."""
    joints = {name: JointUnits(name) for name in description.arm_joints}
    return RobotUnits(description, joints, None, GripperUnits("gripper.pos", _OPEN, 0.0))


def plain(description: RobotDescription) -> RobotUnits:
    """Return the description's own names, in radians; the gripper from 0 (open) to 1, the base in radians."""
    joints = {name: JointUnits(name, "radians") for name in description.arm_joints}
    base = BaseUnits(unit="radians") if description.base.joints else None
    grip = GripperUnits("gripper.pos", 0.0, 1.0) if description.end_effector.gripper else None
    return RobotUnits(description, joints, base, grip)


UNITS: Mapping[str, Callable[[RobotDescription], RobotUnits]] = {
    "lekiwi": lekiwi,
    "so_follower": so_follower,
    "plain": plain,
}


@dataclass(frozen=True)
class _UnitsTable:
    """A robot's names and units, as a table says them."""

    joints: dict[str, Any]
    base: BaseUnits | None = None
    gripper: GripperUnits | None = None


def robot_units(said: str | Mapping[str, Any], description: RobotDescription) -> RobotUnits:
    """Return names and units: those of a known robot, or as a table says."""
    if isinstance(said, str):
        if said not in UNITS:
            raise unknown_name("units", said, UNITS)
        return UNITS[said](description)
    table = dict(said) if isinstance(said, Mapping) else said
    if isinstance(table, dict):
        for name, kind in (("base", BaseUnits), ("gripper", GripperUnits)):
            if table.get(name) is not None:
                table[name] = decoded(table[name], kind, f"units: {name}")
    units = decoded(table, _UnitsTable, "units")
    joints = {
        name: decoded(joint, JointUnits, f"units: joint {name}") for name, joint in units.joints.items()
    }
    if units.base and len(units.base.pose) not in (0, 3):
        raise HandrailError(f"units: base: pose: expected three names, got {len(units.base.pose)}")
    grip = units.gripper
    if grip and grip.opened == grip.closed:
        raise HandrailError("units: gripper: expected opened and closed to differ")
    return RobotUnits(description, joints, units.base, grip)


def _terms(joint: JointUnits, lower: float, upper: float) -> tuple[float, float]:
    """Return `sign · s` and q₀."""
    if joint.unit == "range":
        return joint.sign * (upper - lower) / 200.0, 0.5 * (lower + upper)
    return joint.sign * _angle(joint.unit), 0.0


def _angle(unit: str) -> float:
    return _DEGREE if unit == "degrees" else 1.0
