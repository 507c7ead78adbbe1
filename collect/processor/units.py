"""Names and units of the joints of a robot of LeRobot's: from its numbers to ours, and back."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

import numpy as np

from handrail.collect.flags import check_names
from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError, check_known
from handrail.controllers.interface.channels import Channels
from handrail.controllers.robot.description import RobotDescription
from handrail.controllers.typed import Number, Text, decoded

POSITION, VELOCITY = ".pos", ".vel"
_OPEN = 35.0  # percent of the jaw's range, −0.17 to 1.75 rad: where the model of the SO-101 is open, 0.5 rad
_OPENARM_OPEN, _REACHY_OPEN = -65.0, 130.0  # degrees; closed at 0
_SENT = {"position": POSITION, "velocity": VELOCITY}
_RADIANS = {"degrees": math.pi / 180.0}  # of an angle's unit; 1 of any other


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
    """The kind of command that the robot takes."""

    def terms(self, lower: float, upper: float) -> tuple[float, float]:
        """Return `sign · s` and q₀ of a joint between limits."""
        if self.unit == "range":
            return self.sign * (upper - lower) / 200.0, 0.5 * (lower + upper)
        return self.sign * _RADIANS.get(self.unit, 1.0), 0.0


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

    def __post_init__(self) -> None:
        """Check the pose."""
        if len(self.pose) not in (0, 3):
            raise HandrailError(f"pose: expected three names, got {len(self.pose)}")

    @property
    def twist(self) -> tuple[str, str, str]:
        """Names of the velocities."""
        return self.x, self.y, self.theta

    @property
    def scale(self) -> FloatArray:
        """Size of the units [m, m, rad], (3,)."""
        return np.array([1.0, 1.0, _RADIANS.get(self.unit, 1.0)])


@dataclass(frozen=True)
class GripperUnits:
    """The gripper: its name, and its values when it is open and closed."""

    name: Text
    opened: Number
    closed: Number

    def __post_init__(self) -> None:
        """Check that it moves."""
        if self.opened == self.closed:
            raise HandrailError("expected opened and closed to differ")

    def closing(self, value: float) -> float:
        """Return how far it is closed, from 0 to 1."""
        share = (value - self.opened) / (self.closed - self.opened)
        return min(max(share, 0.0), 1.0) if math.isfinite(share) else share


@dataclass(frozen=True)
class UnitsTable:
    """Names and units of a robot; joints of the arm are by the description's names."""

    joints: Mapping[str, JointUnits]
    base: BaseUnits | None = None
    gripper: GripperUnits | None = None
    """Of a single hand."""
    grippers: Mapping[str, GripperUnits] = field(default_factory=dict)
    """Of several hands, by their names."""


class BodyReading(NamedTuple):
    """The state in an observation [m, rad]: joints, (n − b,); base's twist and pose, (3,); openings, (h,)."""

    arm: FloatArray
    twist: FloatArray
    pose: FloatArray | None
    openings: FloatArray


class RobotUnits:
    """Names and units of a whole robot.

    Args:
        description: of the robot.
        table: its names and units.

    Attributes:
        base: None on a fixed base.
        grippers: of each hand; None where it has none.
        positions: names of the arm's positions.
        action_names: of the action's entries, in order.
        observation_names: of the numbers that an observation has to have.
        sends_position: which joints of the arm are sent positions, (n − b,).
        scale: of the arm's units, with their signs [rad, m], (n − b,).
    """

    def __init__(self, description: RobotDescription, table: UnitsTable) -> None:
        arm, b, limits = description.arm_joints, len(description.base.joints), description.limits
        hands = [hand.name for hand in description.hands]
        given = table.grippers if len(hands) > 1 else {hands[0]: table.gripper}
        if set(table.grippers) - set(hands) or (len(hands) > 1 and table.gripper):
            words = "grippers of " + ", ".join(hands) if len(hands) > 1 else "gripper alone"
            raise HandrailError(f"units of robot {description.name}: expected {words}, got others")
        self.base, self.grippers = table.base, tuple(given.get(hand) for hand in hands)
        if set(table.joints) != set(arm) or bool(self.base) != bool(b):
            raise HandrailError(
                f"units of robot {description.name}: expected joints {', '.join(arm)} and "
                f"{'a' if b else 'no'} base; got {', '.join(table.joints) or 'no joints'} "
                f"and {'a' if self.base else 'no'} base"
            )
        joints = [table.joints[name] for name in arm]
        ends = zip(joints, limits.position_lower[b:], limits.position_upper[b:], strict=True)
        terms = [joint.terms(lower, upper) for joint, lower, upper in ends]
        self.scale, self._centre = np.array(terms).reshape(-1, 2).T
        self._zero = np.array([joint.zero for joint in joints])
        self.sends_position = np.array([joint.sends == "position" for joint in joints], dtype=bool)
        self.positions = tuple(joint.name + POSITION for joint in joints)
        sent = (joint.name + _SENT[joint.sends] for joint in joints)
        grip = tuple(each.name for each in self.grippers if each)
        twist = self.base.twist if self.base else ()
        self.action_names = (*sent, *grip, *twist)
        self.observation_names = (*self.positions, *grip, *(self.base.pose or twist if self.base else ()))
        for names in (self.action_names, self.observation_names):
            check_names("name", f"units of robot {description.name}", names, names)

    def read(self, observation: Any) -> BodyReading | None:
        """Return what an observation says; None where a number is missing or not finite."""
        values = {name: number(observation, name) for name in self.observation_names}
        if not all(map(math.isfinite, values.values())):
            return None
        arm = self.joint_positions(np.array([values[name] for name in self.positions]))
        twist, pose = np.zeros(3), None
        if self.base and self.base.pose:
            pose = self.base.scale * [values[name] for name in self.base.pose]
        elif self.base:
            twist = self.base.scale * [values[name] for name in self.base.twist]
        openings = [1.0 - each.closing(values[each.name]) if each else 0.0 for each in self.grippers]
        return BodyReading(arm, twist, pose, np.array(openings))

    def action(
        self, q: FloatArray, v: FloatArray, twist: FloatArray, grippers: Sequence[float] | FloatArray
    ) -> dict[str, float]:
        """Return the robot's action.

        Args:
            q: where the arm's joints shall be, (n − b,).
            v: how fast they shall move, (n − b,).
            twist: of the base in its own frame [m/s, rad/s], (3,).
            grippers: of each hand, 0 open, 1 closed, (h,).
        """
        values = np.where(self.sends_position, (q - self._centre) / self.scale + self._zero, v / self.scale)
        numbers = values.tolist()
        for each, closed in zip(self.grippers, grippers, strict=True):
            numbers += [each.opened + closed * (each.closed - each.opened)] if each else []
        if self.base:
            numbers += (twist / self.base.scale).tolist()
        return dict(zip(self.action_names, map(float, numbers), strict=True))

    def joint_positions(self, values: FloatArray) -> FloatArray:
        """Return the arm's joints from the robot's values, (n − b,) [m, rad]."""
        return self._centre + self.scale * (values - self._zero)


def number(values: Any, name: str) -> float:
    """Return the number of a name; NaN where there is none, or something else."""
    try:
        return float(values[name])
    except (KeyError, TypeError, ValueError, OverflowError, RuntimeError):  # torch raises the last
        return math.nan


def robot_units(said: str | Mapping[str, Any], description: RobotDescription) -> RobotUnits:
    """Return names and units of a robot: of a table, or as one of LeRobot's robots has them.

    `plain` are the description's own names in radians, the gripper from 0 (open) to 1, the base in radians.
    """
    if not isinstance(said, str):
        return RobotUnits(description, decoded(said, UnitsTable, "units"))
    check_known("units", (said,), _KNOWN)
    return RobotUnits(description, _KNOWN[said](description))


def _plain(description: RobotDescription) -> UnitsTable:
    base = BaseUnits(unit="radians") if description.base.joints else None
    hands = [hand for hand in description.hands if hand.gripper]
    own = {hand.name: GripperUnits(hand.named("gripper.pos"), 0.0, 1.0) for hand in hands}
    joints = {name: JointUnits(name, "radians") for name in description.arm_joints}
    return UnitsTable(joints, base, own.pop("", None), own)


def _in_degrees(prefix: str, base: BaseUnits | None) -> Callable[[RobotDescription], UnitsTable]:
    """Return the units of SO-100s or SO-101s: of one, or of one a hand."""

    def table(description: RobotDescription) -> UnitsTable:
        joints = {name: JointUnits(prefix + name) for name in description.arm_joints}
        firsts = {hand.name: f"{hand.name}_" if hand.name else prefix for hand in description.hands}
        own = {hand: GripperUnits(f"{first}gripper.pos", _OPEN, 0.0) for hand, first in firsts.items()}
        return UnitsTable(joints, base if description.base.joints else None, own.pop("", None), own)

    return table


def _bi_openarm_follower(description: RobotDescription) -> UnitsTable:
    """Return units in which the joints of each arm are numbered from 1."""
    channels, joints, grippers = Channels.of(description), {}, {}
    for hand in (hand.name for hand in description.hands if hand.name):
        arm = np.array(description.joints)[channels.mask(f"{hand}.arm")[channels.joint_slice]]
        joints |= {str(name): JointUnits(f"{hand}_joint_{i}") for i, name in enumerate(arm, start=1)}
        grippers[hand] = GripperUnits(f"{hand}_gripper.pos", _OPENARM_OPEN, 0.0)
    return UnitsTable(joints, None, None, grippers)


def _reachy2(description: RobotDescription) -> UnitsTable:
    joints = {name: JointUnits(name) for name in description.arm_joints}
    base = BaseUnits("mobile_base.vx", "mobile_base.vy", "mobile_base.vtheta")
    hands = {hand.name: f"{hand.name[:1]}_gripper.pos" for hand in description.hands}
    grippers = {hand: GripperUnits(name, _REACHY_OPEN, 0.0) for hand, name in hands.items()}
    return UnitsTable(joints, base if description.base.joints else None, None, grippers)


_KNOWN: Mapping[str, Callable[[RobotDescription], UnitsTable]] = {
    "bi_openarm_follower": _bi_openarm_follower,
    "bi_so_follower": _in_degrees("", BaseUnits()),
    "lekiwi": _in_degrees("arm_", BaseUnits()),
    "plain": _plain,
    "reachy2": _reachy2,
    "so_follower": _in_degrees("", None),
}
