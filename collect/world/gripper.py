"""The gripper: two fingers that hold by friction, sliding or as a jaw; the camera that watches them."""

import numpy as np
import pinocchio as pin

from handrail.collect.world import geometry
from handrail.collect.world.gl import MjsBody, MjSpec, mujoco
from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.parts import Gripper, Jaw

_STEEL, _RUBBER = (0.30, 0.31, 0.33, 1.0), (0.10, 0.10, 0.11, 1.0)
_REFLECTED = 1.0  # inertia of the motor behind each finger, seen through its gear [kg]
JAW = "finger_left"
_STIFFNESS, _DAMPING = 6000.0, 120.0  # of its servo, at the pad [N/m], [N s/m]


def add_gripper(
    spec: MjSpec, gripper: Gripper, mount: MjsBody, frame: pin.SE3, jaw: pin.SE3 | None, grips: bool
) -> MjsBody:
    """Add palm mass, fingers, their servo and the wrist camera to the body that carries the frame.

    Where it does not grip, the fingers are fixed, open: moving ones take a third of a physics step.

    Args:
        spec: the spec to add to.
        gripper: of the robot.
        mount: the body that carries it.
        frame: its placement on that body.
        jaw: the placement there of the link that turns, at its joint's zero; None of one that slides.
        grips: whether the fingers move.

    Returns:
        The body that moves with the finger at −x.
    """
    palm = mount.add_body(name="gripper", gravcomp=1.0, **geometry.pose(frame.translation, frame.rotation))
    length = abs(gripper.tip - gripper.finger_size[2])
    size = np.array([gripper.stroke, gripper.stroke, length])
    geometry.set_box_inertia(palm, gripper.mass, size, [0.0, 0.0, length / 2])
    if gripper.jaw is None or jaw is None:
        left = _add_fingers(spec, gripper, palm, grips)
    else:
        left = _add_turning_finger(spec, gripper, gripper.jaw, palm, frame.actInv(jaw), grips)
    palm.add_camera(name="wrist", fovy=70.0, **_camera_pose(gripper))
    return left


def _add_fingers(spec: MjSpec, gripper: Gripper, palm: MjsBody, grips: bool) -> MjsBody:
    """Add two fingers that slide; return the body of the left one."""
    bodies = []
    for name, side in (("finger_left", -1.0), ("finger_right", 1.0)):
        bodies.append(_add_finger(palm, gripper, name, side, 0.0 if grips else gripper.stroke / 2))
        if grips:
            _add_finger_joint(bodies[-1], gripper, name, [side, 0.0, 0.0], 1.0)
    _add_rail(palm, gripper)
    if grips:
        _couple(spec)
        tendon = spec.add_tendon(name="opening")
        for finger in ("finger_left", "finger_right"):
            tendon.wrap_joint(finger, 1.0)
        _add_servo(spec, gripper, "opening", mujoco.mjtTrn.mjTRN_TENDON)
    return bodies[0]


def _add_turning_finger(
    spec: MjSpec, gripper: Gripper, jaw: Jaw, palm: MjsBody, zero: pin.SE3, grips: bool
) -> MjsBody:
    """Add the finger that stands still and the jaw; their meshes are drawn, not their pads."""
    body = _add_jaw(spec, gripper, jaw, palm, zero, grips)
    for name, pad in _pads(gripper, jaw, zero).items():
        at = geometry.pose(pad.translation, pad.rotation)
        _add_pad(body if name == JAW else palm, gripper, name, group=geometry.HIDDEN_GROUP, **at)
    return body


def _add_finger(palm: MjsBody, gripper: Gripper, name: str, side: float, away: float) -> MjsBody:
    """Add a finger at a distance from its closed position [m]."""
    width, _, length = gripper.finger_size
    position = [side * (width / 2 + away), 0.0, gripper.tip - length / 2]
    finger = palm.add_body(name=f"{name}_body", pos=position, gravcomp=1.0)
    geometry.set_box_inertia(finger, gripper.finger_mass, gripper.finger_size)
    _add_pad(finger, gripper, name, group=geometry.VISIBLE_GROUP)
    return finger


def _add_pad(body: MjsBody, gripper: Gripper, name: str, **options: object) -> None:
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
        **options,
    )


def _add_rail(palm: MjsBody, gripper: Gripper) -> None:
    """Draw what the fingers slide on."""
    width, depth, length = gripper.finger_size
    thickness = min(0.025, (gripper.tip - length) / 2)
    palm.add_geom(
        name="rail",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[gripper.stroke / 2 + width, depth / 2, thickness / 2],
        pos=[0.0, 0.0, gripper.tip - length - thickness / 2],
        contype=0,
        conaffinity=0,
        group=geometry.VISIBLE_GROUP,
        rgba=_STEEL,
    )


def _couple(spec: MjSpec) -> None:
    """Make the fingers mirror each other, as the rack between them does."""
    coupling = spec.add_equality(
        name="fingers", objtype=mujoco.mjtObj.mjOBJ_JOINT, type=mujoco.mjtEq.mjEQ_JOINT
    )
    coupling.name1, coupling.name2 = "finger_left", "finger_right"
    data = np.zeros_like(coupling.data)
    data[1] = 1.0
    coupling.data = data
    coupling.solref = [0.004, 1.0]


def _add_finger_joint(finger: MjsBody, gripper: Gripper, name: str, axis: list[float], lever: float) -> None:
    """Let a finger slide (lever 1), or turn; its coordinate counts from where it is closed [m, rad]."""
    kind = mujoco.mjtJoint.mjJNT_SLIDE if gripper.jaw is None else mujoco.mjtJoint.mjJNT_HINGE
    finger.add_joint(
        name=name,
        type=kind,
        axis=axis,
        limited=True,
        range=[0.0, gripper.stroke / 2 if gripper.jaw is None else gripper.travel],
        armature=_REFLECTED * lever**2,
        damping=[20.0 * lever**2, 0.0, 0.0],
    )


def _add_servo(spec: MjSpec, gripper: Gripper, target: str, kind: object, lever: float = 1.0) -> None:
    """Add a position servo on the opening [m, rad]; the force of a pad [N] at a lever is limited."""
    servo = spec.add_actuator(
        name="gripper",
        target=target,
        trntype=kind,
        ctrlrange=[-gripper.beyond, gripper.travel],
        forcerange=[-gripper.force * lever, gripper.force * lever],
    )
    servo.set_to_position(kp=_STIFFNESS * lever**2, kv=_DAMPING * lever**2)


def _camera_pose(gripper: Gripper) -> dict[str, FloatArray]:
    """Return the pose of a camera beside the palm that looks along z, tilted towards the finger tips.

    MuJoCo's cameras look along their −z with y up; the fingers open from left to right in the picture.
    """
    offset = np.array(gripper.camera)
    sideways = np.cross([0.0, 0.0, 1.0], offset)
    if not np.any(sideways):
        sideways = np.array([1.0, 0.0, 0.0])
    right = sideways / np.linalg.norm(sideways)
    outward = np.cross(right, [0.0, 0.0, 1.0])  # unit, from the axis to the camera
    forward = np.cos(gripper.camera_tilt) * np.array([0.0, 0.0, 1.0]) - np.sin(gripper.camera_tilt) * outward
    up = np.cross(right, forward)
    return geometry.pose(offset, np.column_stack([right, up, -forward]))


def _pads(gripper: Gripper, jaw: Jaw, zero: pin.SE3) -> dict[str, pin.SE3]:
    """Return where the pads are: `finger_right` in the palm's frame, `finger_left` in the jaw's.

    Args:
        gripper: with the jaw.
        jaw: it.
        zero: the jaw's link in the palm's frame, at its joint's zero.
    """
    width, _, length = gripper.finger_size
    height = gripper.tip - length / 2
    still = pin.SE3(np.eye(3), np.array([width / 2, 0.0, height]))
    parallel = pin.SE3(np.eye(3), np.array([-jaw.gap - width / 2, 0.0, height]))
    return {"finger_right": still, JAW: _turned(zero, jaw.parallel).inverse() * parallel}


def _turned(zero: pin.SE3, angle: float) -> pin.SE3:
    """Return the jaw's link at an angle of its joint [rad]."""
    return zero * pin.SE3(pin.exp3(np.array([0.0, 0.0, angle])), np.zeros(3))


def _add_jaw(spec: MjSpec, gripper: Gripper, jaw: Jaw, palm: MjsBody, zero: pin.SE3, grips: bool) -> MjsBody:
    """Add the body of the jaw, which turns if it grips, else stays open; return it.

    Its servo's torque is limited to the gripper's force at the middle of the pad.
    """
    at = _turned(zero, jaw.closed if grips else jaw.open)
    body = palm.add_body(name=f"{JAW}_body", gravcomp=1.0, **geometry.pose(at.translation, at.rotation))
    pad = _pads(gripper, jaw, zero)[JAW]
    geometry.set_box_inertia(body, gripper.finger_mass, gripper.finger_size, pad.translation)
    if not grips:
        return body
    lever = float(np.hypot(*pad.translation[:2]))
    _add_finger_joint(body, gripper, JAW, [0.0, 0.0, 1.0], lever)
    _add_servo(spec, gripper, JAW, mujoco.mjtTrn.mjTRN_JOINT, lever)
    return body
