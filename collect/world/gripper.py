"""The gripper: two fingers that hold by friction, sliding or as a jaw."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from handrail.collect.world import geometry
from handrail.collect.world.gl import MjData, MjModel, MjsBody, MjSpec, mujoco
from handrail.controllers.arrays import IntArray
from handrail.controllers.robot.parts import EndEffector, Gripper, Jaw

_STEEL, _RUBBER = (0.30, 0.31, 0.33, 1.0), (0.10, 0.10, 0.11, 1.0)
_REFLECTED = 1.0  # inertia of the motor behind each finger, seen through its gear [kg]
_STIFFNESS, _DAMPING = 6000.0, 120.0  # of its servo, at the pad [N/m], [N s/m]


def fingers(hand: EndEffector) -> tuple[str, str]:
    """Return the names of the pads, and of the joints by which they move; of a jaw only the first moves."""
    return hand.named("finger_left"), hand.named("finger_right")


@dataclass(frozen=True)
class FingersServo:
    """A gripper in MuJoCo's arrays: the coordinates of its fingers, and the servo that moves them."""

    gripper: Gripper
    joints: IntArray
    actuator: int

    @classmethod
    def of(cls, model: MjModel, hand: EndEffector) -> "FingersServo | None":
        """Return that of a hand, if it has a gripper."""
        if (gripper := hand.gripper) is None:
            return None
        moving = fingers(hand) if gripper.jaw is None else fingers(hand)[:1]
        joints = np.array([model.joint(name).qposadr[0] for name in moving])
        return cls(gripper, joints, model.actuator(hand.named("gripper")).id)

    def begin(self, data: MjData, width: float | None) -> None:
        """Be closed around something of a width [m], or open."""
        travel = self.gripper.travel
        apart = travel if width is None else width * (travel / self.gripper.stroke)
        data.qpos[self.joints] = apart / len(self.joints)
        data.ctrl[self.actuator] = self.target(float(width is not None))

    def target(self, closed: float) -> float:
        """Return the opening that the servo is sent to [m, rad]; closed is a little beyond it."""
        return (1.0 - closed) * self.gripper.travel - self.gripper.beyond * closed

    def opening(self, data: MjData) -> float:
        """Return how far it is open, from 0 to 1."""
        return min(max(float(data.qpos[self.joints].sum() / self.gripper.travel), 0.0), 1.0)


def add_gripper(
    spec: MjSpec, hand: EndEffector, mount: MjsBody, frame: pin.SE3, zero: pin.SE3 | None, grips: bool
) -> MjsBody:
    """Add palm mass, fingers and their servo; return the body of the first finger.

    Where it does not grip, the fingers are fixed, open: moving ones take a third of a physics step.

    Args:
        spec: the spec to add to.
        hand: with a gripper.
        mount: the body that carries it.
        frame: its placement on that body.
        zero: the placement there of the jaw's link, at its joint's zero; None of fingers that slide.
        grips: whether the fingers move.
    """
    gripper, at = hand.gripper, geometry.pose(frame.translation, frame.rotation)
    assert gripper
    palm = mount.add_body(name=hand.named("gripper"), gravcomp=1.0, **at)
    length = abs(gripper.tip - gripper.finger_size[2])
    size = np.array([gripper.stroke, gripper.stroke, length])
    geometry.set_box_inertia(palm, gripper.mass, size, [0.0, 0.0, length / 2])
    if gripper.jaw is None or zero is None:
        return _add_sliding_fingers(spec, hand, gripper, palm, grips)
    return _add_jaw(spec, hand, gripper, gripper.jaw, palm, frame.actInv(zero), grips)


def _shifted(x: float, z: float) -> pin.SE3:
    return pin.SE3(np.eye(3), np.array([x, 0.0, z]))


def _add_sliding_fingers(
    spec: MjSpec, hand: EndEffector, gripper: Gripper, palm: MjsBody, grips: bool
) -> MjsBody:
    width, depth, length = gripper.finger_size
    apart = width / 2 + (0.0 if grips else gripper.stroke / 2)
    height, pad = gripper.tip - length / 2, pin.SE3.Identity()
    left, _ = (
        _add_finger(palm, gripper, name, _shifted(side * apart, height), [side, 0.0, 0.0], grips, pad)
        for name, side in zip(fingers(hand), (-1.0, 1.0), strict=True)
    )
    thickness = min(0.025, (gripper.tip - length) / 2)
    palm.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[gripper.stroke / 2 + width, depth / 2, thickness / 2],
        pos=[0.0, 0.0, gripper.tip - length - thickness / 2],
        group=geometry.VISIBLE_GROUP,
        rgba=_STEEL,
        **geometry.UNTOUCHED,
    )
    if grips:
        _couple(spec, hand)
        _add_servo(spec, hand, gripper, hand.named("opening"), mujoco.mjtTrn.mjTRN_TENDON)
    return left


def _couple(spec: MjSpec, hand: EndEffector) -> None:
    """Make the fingers mirror each other, as the rack between them does; the tendon is their opening."""
    coupling = spec.add_equality(
        name=hand.named("fingers"), objtype=mujoco.mjtObj.mjOBJ_JOINT, type=mujoco.mjtEq.mjEQ_JOINT
    )
    coupling.name1, coupling.name2 = fingers(hand)
    data = np.zeros_like(coupling.data)
    data[1] = 1.0
    coupling.data, coupling.solref = data, [0.004, 1.0]
    tendon = spec.add_tendon(name=hand.named("opening"))
    for finger in fingers(hand):
        tendon.wrap_joint(finger, 1.0)


def _add_jaw(
    spec: MjSpec, hand: EndEffector, gripper: Gripper, jaw: Jaw, palm: MjsBody, zero: pin.SE3, grips: bool
) -> MjsBody:
    """Add the finger that stands still and the jaw; their meshes are drawn, not their pads.

    The torque of the jaw's servo is limited to the gripper's force at the middle of the pad.

    Args:
        spec: the spec to add to.
        hand: whose it is.
        gripper: with the jaw.
        jaw: it.
        palm: the body that carries both.
        zero: the jaw's link in the palm's frame, at its joint's zero.
        grips: whether the jaw turns; else it stays open.
    """
    width, _, length = gripper.finger_size
    height = gripper.tip - length / 2
    pad = _turned(zero, jaw.parallel).inverse() * _shifted(-jaw.gap - width / 2, height)
    lever = float(np.hypot(*pad.translation[:2]))
    at = _turned(zero, jaw.closed if grips else jaw.open)
    turning, standing = fingers(hand)
    body = _add_finger(palm, gripper, turning, at, [0.0, 0.0, 1.0], grips, pad, lever)
    _add_pad(palm, gripper, standing, _shifted(width / 2, height))
    if grips:
        _add_servo(spec, hand, gripper, turning, mujoco.mjtTrn.mjTRN_JOINT, lever)
    return body


def _turned(zero: pin.SE3, angle: float) -> pin.SE3:
    """Return the jaw's link at an angle of its joint [rad]."""
    return zero * pin.SE3(pin.exp3(np.array([0.0, 0.0, angle])), np.zeros(3))


def _add_finger(
    palm: MjsBody,
    gripper: Gripper,
    name: str,
    at: pin.SE3,
    axis: list[float],
    grips: bool,
    pad: pin.SE3,
    lever: float = 1.0,
) -> MjsBody:
    """Add a finger that slides (lever 1), or turns; its coordinate is 0 where it is closed [m, rad]."""
    body = palm.add_body(name=f"{name}_body", gravcomp=1.0, **geometry.pose(at.translation, at.rotation))
    geometry.set_box_inertia(body, gripper.finger_mass, gripper.finger_size, pad.translation)
    _add_pad(body, gripper, name, pad)
    if grips:
        slides = gripper.jaw is None
        body.add_joint(
            name=name,
            type=mujoco.mjtJoint.mjJNT_SLIDE if slides else mujoco.mjtJoint.mjJNT_HINGE,
            axis=axis,
            limited=True,
            range=[0.0, gripper.travel / 2 if slides else gripper.travel],
            armature=_REFLECTED * lever**2,
            damping=[20.0 * lever**2, 0.0, 0.0],
        )
    return body


def _add_pad(body: MjsBody, gripper: Gripper, name: str, at: pin.SE3) -> None:
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=np.array(gripper.finger_size) / 2,
        contype=geometry.ROBOT_BIT,
        conaffinity=geometry.SCENE_BIT | geometry.FLOOR_BIT,
        condim=4,
        friction=[gripper.friction, 0.02, 0.0001],
        priority=1,
        solref=[0.004, 1.0],
        solimp=[0.95, 0.99, 0.001, 0.5, 2.0],
        rgba=_RUBBER,
        group=geometry.VISIBLE_GROUP if gripper.jaw is None else geometry.HIDDEN_GROUP,
        **geometry.pose(at.translation, at.rotation),
    )


def _add_servo(
    spec: MjSpec, hand: EndEffector, gripper: Gripper, target: str, kind: object, lever: float = 1.0
) -> None:
    """Add a position servo on the opening [m, rad]; the force of a pad [N] at a lever is limited."""
    servo = spec.add_actuator(
        name=hand.named("gripper"),
        target=target,
        trntype=kind,
        ctrlrange=[-gripper.beyond, gripper.travel],
        forcerange=[-gripper.force * lever, gripper.force * lever],
    )
    servo.set_to_position(kp=_STIFFNESS * lever**2, kv=_DAMPING * lever**2)
