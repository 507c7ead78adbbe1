"""The gripper whose one finger turns: its joint counts the angle from where it is closed."""

import numpy as np
import pinocchio as pin

from handrail.collect.world import geometry
from handrail.collect.world.gl import MjsBody, MjSpec, mujoco
from handrail.controllers.robot.description import Gripper, Jaw

JAW = "finger_left"
_STIFFNESS, _DAMPING, _REFLECTED = 6000.0, 120.0, 1.0  # of its servo, at the pad [N/m], [N s/m], [kg]


def pads(gripper: Gripper, jaw: Jaw, zero: pin.SE3) -> dict[str, pin.SE3]:
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
    return {"finger_right": still, JAW: turned(zero, jaw.parallel).inverse() * parallel}


def turned(zero: pin.SE3, angle: float) -> pin.SE3:
    """Return the jaw's link at an angle of its joint [rad]."""
    return zero * pin.SE3(pin.exp3(np.array([0.0, 0.0, angle])), np.zeros(3))


def add_jaw(spec: MjSpec, gripper: Gripper, jaw: Jaw, palm: MjsBody, zero: pin.SE3, grips: bool) -> MjsBody:
    """Add the body of the jaw, which turns if it grips, else stays open; return it.

    Its servo's torque is limited to the gripper's force at the middle of the pad.
    """
    at = turned(zero, jaw.closed if grips else jaw.open)
    body = palm.add_body(name=f"{JAW}_body", gravcomp=1.0, **geometry.pose(at.translation, at.rotation))
    pad = pads(gripper, jaw, zero)[JAW]
    body.explicitinertial = True
    body.mass, body.ipos, body.iquat = gripper.finger_mass, pad.translation, [1.0, 0.0, 0.0, 0.0]
    body.inertia = geometry.box_inertia(gripper.finger_mass, np.array(gripper.finger_size))
    if not grips:
        return body
    lever = float(np.hypot(*pad.translation[:2]))
    body.add_joint(
        name=JAW,
        type=mujoco.mjtJoint.mjJNT_HINGE,
        axis=[0.0, 0.0, 1.0],
        limited=True,
        range=[0.0, gripper.travel],
        armature=_REFLECTED * lever**2,
        damping=[20.0 * lever**2, 0.0, 0.0],
    )
    servo = spec.add_actuator(
        name="gripper",
        target=JAW,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        ctrlrange=[-gripper.beyond, gripper.travel],
        forcerange=[-gripper.force * lever, gripper.force * lever],
    )
    servo.set_to_position(kp=_STIFFNESS * lever**2, kv=_DAMPING * lever**2)
    return body
