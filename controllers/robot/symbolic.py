"""Symbolic kinematics: CasADi expressions of the model that pinocchio describes."""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import Joint, RobotModel, joints_of


@dataclass(frozen=True)
class SymbolicPose:
    """Position (3, 1), rotation world from frame (3, 3), Jacobian (6, n) of a frame: expressions of q."""

    position: ca.SX
    rotation: ca.SX
    jacobian: ca.SX


def symbolic_pose(model: RobotModel, q: ca.SX, frame: str = "") -> SymbolicPose:
    """Return the pose and the world-aligned geometric Jacobian of a frame at q, (n, 1).

    `p = p_j + R_j p_frame` along the chain of joints; a revolute column is `(z × (p - p_j), z)`, a
    prismatic one `(z, 0)`.
    """
    target = model.pinocchio.frames[model.frame_id(frame)]
    joints = joints_of(model)
    poses: list[tuple[ca.SX, ca.SX]] = _joint_poses(joints, q)
    origin, rotation = poses[target.parentJoint]
    position = origin + rotation @ target.placement.translation
    columns = [ca.SX.zeros(6, 1)] * len(joints)
    index = target.parentJoint
    while index > 0:
        joint_origin, joint_rotation = poses[index]
        columns[index - 1] = _column(joints[index - 1], joint_origin, joint_rotation, position)
        index = joints[index - 1].parent
    return SymbolicPose(position, rotation @ target.placement.rotation, ca.horzcat(*columns))


def _column(joint: Joint, origin: ca.SX, rotation: ca.SX, position: ca.SX) -> ca.SX:
    axis = rotation @ joint.axis
    if joint.prismatic:
        return ca.vertcat(axis, ca.SX.zeros(3, 1))
    return ca.vertcat(ca.cross(axis, position - origin), axis)


def _joint_poses(joints: tuple[Joint, ...], q: ca.SX) -> list[tuple[ca.SX, ca.SX]]:
    poses = [(ca.SX.zeros(3, 1), ca.SX.eye(3))]
    for index, joint in enumerate(joints):
        origin, rotation = poses[joint.parent]
        position = origin + rotation @ joint.translation
        local = rotation @ joint.rotation
        if joint.prismatic:
            poses.append((position + local @ joint.axis * q[index], local))
        else:
            poses.append((position, local @ _rotation(joint.axis, q[index])))
    return poses


def _rotation(axis: FloatArray, angle: ca.SX) -> ca.SX:
    """Rodrigues' formula for a constant unit axis, `a aᵀ + cos (I - a aᵀ) + sin [a]×`."""
    outer = np.outer(axis, axis)
    cross = np.cross(np.eye(3), axis)
    return ca.SX(outer) + ca.cos(angle) * ca.SX(np.eye(3) - outer) + ca.sin(angle) * ca.SX(cross)
