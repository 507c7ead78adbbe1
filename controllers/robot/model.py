"""The kinematic model of a robot: pinocchio's, built from the description."""

import os
import re
import tempfile
from collections import defaultdict
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from threading import get_ident
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from handrail.controllers.arrays import BoolArray, FloatArray, frozen
from handrail.controllers.core.library import Memory, constant
from handrail.controllers.errors import HandrailError, message_of, unknown_name
from handrail.controllers.robot.description import RobotDescription, check_once, load_description
from handrail.controllers.robot.parts import Arm, EndEffector, PlacedShape, Placement
from handrail.controllers.robot.urdf import followers, urdf_text

_BASE_JOINTS = {"x": pin.JointModelPX, "y": pin.JointModelPY, "theta": pin.JointModelRZ}


@dataclass(frozen=True, eq=False)
class Pose:
    """Position [m], (3,), and rotation world from frame, (3, 3)."""

    position: FloatArray
    rotation: FloatArray


class RobotModel:
    """Forward kinematics and Jacobians, `q = (base, arm)`, `v = dq/dt`.

    Args:
        description: the data it is built from.
        hand: number of the hand whose tool is meant where no frame is named.

    Attributes:
        description: the data it was built from.
        number, hand: of the hand whose tool is meant where no frame is named, and that hand.
        pinocchio: the pinocchio model; never changed after construction.
        size: number of generalised coordinates n.
    """

    def __init__(self, description: RobotDescription, hand: int = 0) -> None:
        self.description, self.number, self.hand = description, hand, description.hands[hand]
        self.pinocchio = _build(description)
        self.size = self.pinocchio.nv
        self._data: dict[int, pin.Data] = defaultdict(self.pinocchio.createData)  # of each thread
        self._frames = {frame.name: self.pinocchio.getFrameId(frame.name) for frame in self.pinocchio.frames}

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the generalised coordinates."""
        return self.description.joints

    @property
    def moving(self) -> BoolArray:
        """Which joints move the hand, (n,)."""
        moves = self.description.moves
        return np.array(moves[self.number] if moves else [True] * self.size)

    def with_hand(self, name: str) -> "RobotModel":
        """Return the model of the same robot that means another hand; the first one where it has no name."""
        names = [hand.name for hand in self.description.hands]
        if name and name not in names:
            raise unknown_name("hand", name, [each or "'' (it has one hand)" for each in names])
        return _of_hand(self, names.index(name) if name else 0)

    def frame_id(self, frame: str) -> int:
        """Return pinocchio's index of a frame; of the hand's tool where it has no name."""
        frame = frame or self.hand.named("tool")
        if frame not in self._frames:
            names = ", ".join(self._frames)
            raise HandrailError(f"frame {frame!r} of robot {self.description.name}: expected one of {names}")
        return self._frames[frame]

    def mount(self, placed: PlacedShape) -> tuple[int, pin.SE3]:
        """Return the joint that carries a shape, and where the shape is on it."""
        frame = self.pinocchio.frames[self.frame_id(placed.frame)]
        return frame.parentJoint, frame.placement * _se3(placed.placement)

    def pose(self, q: FloatArray, frame: str = "") -> Pose:
        """Return the pose of a frame at q, (n,); of the hand's tool by default."""
        data, q = self._at(q)
        pin.forwardKinematics(self.pinocchio, data, q)
        placement = pin.updateFramePlacement(self.pinocchio, data, self.frame_id(frame))
        return Pose(placement.translation.copy(), placement.rotation.copy())

    def jacobian(self, q: FloatArray, frame: str = "") -> FloatArray:
        """Return J with twist = J v, world-aligned at a frame's origin, linear rows first, (6, n)."""
        (data, q), number = self._at(q), self.frame_id(frame)
        return pin.computeFrameJacobian(self.pinocchio, data, q, number, pin.LOCAL_WORLD_ALIGNED).copy()

    def _at(self, q: FloatArray) -> tuple[pin.Data, FloatArray]:
        """Return what this thread computes in, and q, (n,)."""
        q = frozen(q, what="configuration")
        if q.shape != (self.size,):
            raise HandrailError(f"configuration: expected {self.size} numbers, got shape {q.shape}")
        return self._data[get_ident()], q


class Joint(NamedTuple):
    """A joint: its parent, where it is on that, and its axis; joint k, from 1, moves coordinate k - 1."""

    parent: int
    translation: FloatArray
    rotation: FloatArray
    axis: FloatArray
    prismatic: bool


@lru_cache(maxsize=8)
def joints_of(model: RobotModel) -> tuple[Joint, ...]:
    """Return the joints, one a coordinate."""
    robot, found = model.pinocchio, []
    for number in range(1, robot.njoints):
        (linear, angular), place = twist_of(robot, number), robot.jointPlacements[number].copy()
        slides = not angular.any()
        axis = linear if slides else angular
        found.append(Joint(robot.parents[number], place.translation, place.rotation, axis, slides))
    return tuple(found)


def twist_of(model: pin.Model, number: int) -> FloatArray:
    """Return how a joint of one coordinate moves what it carries, (v, ω) as rows, (2, 3)."""
    data = model.joints[number].createData()
    model.joints[number].calc(data, np.zeros(1))
    return np.array(data.S).reshape(2, 3)


def joint_memory(model: RobotModel, shapes: int, pairs: int) -> Memory:
    """Return the compiled core's `Scene` of so many shapes and pairs, with the joints in it."""
    memory, limits = Memory("Scene", {"n": model.size, "S": shapes, "P": pairs}), model.description.limits
    if model.size > (most := int(constant("MOST_COORDINATES"))):
        raise HandrailError(
            f"robot {model.description.name}: expected {most} coordinates at most, got {model.size}"
        )
    memory.lower[:], memory.upper[:] = limits.position_lower, limits.position_upper
    memory.a_max[:] = limits.acceleration
    for index, joint in enumerate(joints_of(model)):
        memory.parent[index], memory.slides[index] = joint.parent, joint.prismatic
        memory.joint_rotation[index] = joint.rotation.ravel()
        memory.joint_position[index], memory.joint_axis[index] = joint.translation, joint.axis
    return memory


@lru_cache(maxsize=8)
def _of_hand(model: RobotModel, hand: int) -> RobotModel:
    return model if hand == model.number else RobotModel(model.description, hand)


@lru_cache(maxsize=8)
def load_model(robot: str | Path = "ridgeback_ur10") -> RobotModel:
    """Build the model of a robot by name or description file."""
    return RobotModel(load_description(robot))


def _build(description: RobotDescription) -> pin.Model:
    base = pin.Model()
    base.name = description.name
    joint = 0
    for name in description.base.joints:
        joint = base.addJoint(joint, _BASE_JOINTS[name](), pin.SE3.Identity(), name)
    base.addFrame(pin.Frame("planar_base", joint, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    model, tools = base, [hand.named("tool") for hand in description.hands]
    for arm in description.arms:
        if not model.existFrame(arm.on, pin.FrameType.BODY):
            raise HandrailError(f"arm {arm.prefix!r} of robot {description.name}: on: no link {arm.on!r}")
        own = _arm(arm, description.name)
        frames = [frame.name for each in (model, own) for frame in list(each.frames)[1:]]
        check_once([*base.names, *tools, *frames], f"URDF {arm.urdf}: names of links and joints")
        model = pin.appendModel(model, own, model.getFrameId(arm.on), _se3(arm.mount))
    if tuple(model.names[1:]) != description.joints:
        expected, got = (", ".join(names) for names in (list(model.names)[1:], description.joints))
        raise HandrailError(f"joints of robot {description.name}: expected the order {expected}, got {got}")
    for hand in description.hands:
        _add_tool(model, hand, description.name)
    _check_hands(model, description)
    return model


def _check_hands(model: pin.Model, description: RobotDescription) -> None:
    """Check that each hand has a joint that moves no other: no two on one link, none on the base."""
    ends = [model.frames[model.getFrameId(hand.named("tool"))].parentJoint for hand in description.hands]
    chains = [set(model.supports[end]) - set(range(len(description.base.joints) + 1)) for end in ends]
    for hand, own in zip(description.hands, chains, strict=True):
        if not own.difference(*(other for other in chains if other is not own)):
            raise HandrailError(
                f"hand {hand.name!r} of robot {description.name}: expected a frame with a joint that moves "
                f"no other hand, got {hand.frame!r}"
            )


def read_urdf(arm: Arm, mimic: bool = False) -> pin.Model:
    """Return all of an arm's URDF, every joint of it free; or with joints that follow another, as it says."""
    text, model, words = urdf_text(arm), None, ""
    with tempfile.TemporaryFile("w+", errors="replace") as said:  # the reader prints what it leaves out
        before = os.dup(2)
        os.dup2(said.fileno(), 2)
        try:
            model = pin.buildModelFromXML(text, mimic=mimic)
        except (ValueError, RuntimeError) as error:
            words = message_of(error)
        finally:
            os.dup2(before, 2)
            os.close(before)
        said.seek(0)
        words = "; ".join(re.findall(r"Error: +(.*)\n.*urdf_parser", said.read())[:2]) or words
    if words or model is None:
        raise HandrailError(f"URDF {arm.urdf}: {words}")
    return model


def _arm(arm: Arm, robot: str) -> pin.Model:
    """Return an arm with every other joint locked as near to 0 as its range allows."""
    model = read_urdf(arm, mimic=True)
    if missing := sorted(set(arm.joints) - set(model.names)):
        raise unknown_name(f"arm joint of robot {robot}", missing[0], list(model.names)[1:])
    if led := [pair for pair in followers(arm) if set(pair) & set(arm.joints)]:
        raise HandrailError(f"arm joints of robot {robot}: expected no mimic, {' follows '.join(led[0])}")
    locked = [model.getJointId(name) for name in list(model.names)[1:] if name not in arm.joints]
    q = np.clip(pin.neutral(model), model.lowerPositionLimit, model.upperPositionLimit)
    reduced = pin.buildReducedModel(model, locked, q) if locked else model
    if reduced.nq != reduced.nv or reduced.nv != len(arm.joints):
        raise HandrailError(f"arm of robot {robot}: expected revolute or prismatic joints in its URDF")
    return reduced


def _add_tool(model: pin.Model, hand: EndEffector, robot: str) -> None:
    if not model.existFrame(hand.frame, pin.FrameType.BODY):
        raise HandrailError(f"tool frame {hand.frame!r} of robot {robot}: no link of its URDF")
    parent_id = model.getFrameId(hand.frame)
    parent = model.frames[parent_id]
    placement = parent.placement * _se3(hand.placement)
    model.addFrame(
        pin.Frame(hand.named("tool"), parent.parentJoint, parent_id, placement, pin.FrameType.OP_FRAME)
    )


def _se3(placement: Placement) -> pin.SE3:
    return pin.SE3(np.array(placement.rotation), np.array(placement.translation))
