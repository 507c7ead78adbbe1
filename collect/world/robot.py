"""MuJoCo's robot, built from the very model that pinocchio and CasADi use.

Every joint placement, axis and inertia comes from the pinocchio model, every contact shape from the robot
description, so that the simulated robot and the controller's cannot drift apart.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from handrail.collect.world import geometry
from handrail.collect.world.gl import MjsBody, MjSpec, mujoco
from handrail.collect.world.gripper import JAW, add_gripper
from handrail.collect.world.meshes import placed_meshes
from handrail.controllers.errors import HandrailError
from handrail.controllers.numerics.rotation import quaternion_from_matrix
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.parts import Gripper, PlacedShape, Placement
from handrail.controllers.robot.scene_shapes import floor_shapes

BASE_BODY = "planar_base"
FINGERS = ("finger_left", "finger_right")
_DRIVE_TIME = 0.0025  # [s]


@dataclass(frozen=True)
class SimulatedRobot:
    """A robot in MuJoCo, to which a scene can be added.

    Attributes:
        spec: bodies, joints, actuators, cameras of the robot.
        contact_geoms: names of its geoms that collide.
        grasp_geoms: those that may touch movable things: fingers and palm.
        finger_joints: names of the joints by which its fingers move; none where they do not.
    """

    spec: MjSpec
    contact_geoms: tuple[str, ...]
    grasp_geoms: tuple[str, ...]
    finger_joints: tuple[str, ...]


class Mounts:
    """Where pinocchio's frames are in MuJoCo's tree; the bodies are by pinocchio's joint index."""

    def __init__(self, model: RobotModel, bodies: list[MjsBody]) -> None:
        self._model, self.bodies = model, bodies

    def place(self, frame: str, placement: Placement) -> tuple[MjsBody, pin.SE3]:
        """Return the body that carries something placed on a frame, and where that is on the body."""
        mount = self._model.pinocchio.frames[self._model.frame_id(frame)]
        on_frame = pin.SE3(np.array(placement.rotation), np.array(placement.translation))
        return self.bodies[mount.parentJoint], mount.placement * on_frame


def build_robot(model: RobotModel, meshes: bool = True, grips: bool = True) -> SimulatedRobot:
    """Build the robot; without `meshes` it moves and collides alike, but is not for looking at.

    Args:
        model: of the robot.
        meshes: whether to draw it as it looks.
        grips: whether its fingers move; else they stay open.
    """
    spec = mujoco.MjSpec()
    spec.modelname = model.description.name
    spec.compiler.degree = False
    mounts = Mounts(model, _add_bodies(spec, model))
    tool = model.pinocchio.frames[model.frame_id("tool")]
    at = geometry.pose(tool.placement.translation, tool.placement.rotation)
    mounts.bodies[tool.parentJoint].add_site(name="tool", group=4, **at)
    contact = _add_contact_shapes(model, mounts)
    gripper = model.description.end_effector.gripper
    jaw = None
    if gripper is not None:
        jaw = _add_hand(spec, model, gripper, mounts, grips)
        contact += FINGERS
    _add_pairs(spec, model)
    _add_servos(spec, model)
    if meshes:
        _add_meshes(spec, model, mounts, jaw)
        for index, shape in enumerate(model.description.visual):
            ghost = _ghost(geometry.VISIBLE_GROUP)
            _add_shape(mounts, shape, name=f"visual_{index}", rgba=shape.rgba, **ghost)
    return SimulatedRobot(spec, contact, _grasp_geoms(model, contact), _finger_joints(gripper, grips))


def _add_hand(
    spec: MjSpec, model: RobotModel, gripper: Gripper, mounts: Mounts, grips: bool
) -> tuple[str, MjsBody, pin.SE3] | None:
    """Add the gripper; return the URDF's link that turns, its body, and its zero on the hand's body."""
    body, frame = mounts.place(gripper.frame, gripper.placement)
    if gripper.jaw is None:
        add_gripper(spec, gripper, body, frame, None, grips)
        return None
    carrier, zero = mounts.place(gripper.jaw.frame, Placement(np.zeros(3), np.eye(3)))
    if carrier is not body:
        raise HandrailError(
            f"jaw of robot {model.description.name}: expected a frame on the link of {gripper.frame!r}, "
            f"got {gripper.jaw.frame!r}"
        )
    return gripper.jaw.frame, add_gripper(spec, gripper, body, frame, zero, grips), zero


def _finger_joints(gripper: Gripper | None, grips: bool) -> tuple[str, ...]:
    if gripper is None or not grips:
        return ()
    return FINGERS if gripper.jaw is None else (JAW,)


def _ghost(group: int) -> dict[str, int]:
    return {"contype": 0, "conaffinity": 0, "group": group}


def _add_bodies(spec: MjSpec, model: RobotModel) -> list[MjsBody]:
    """Add one body for the base and one for each arm joint; return them by pinocchio's joint index."""
    description, pinocchio = model.description, model.pinocchio
    base = spec.worldbody.add_body(name=BASE_BODY)
    bodies = [base]
    on_base = len(description.base.joints)
    for index in range(1, pinocchio.njoints):
        body = base
        if index > on_base:
            placement = pinocchio.jointPlacements[index]
            body = bodies[pinocchio.parents[index]].add_body(
                name=f"{pinocchio.names[index]}_body",
                gravcomp=1.0,
                **geometry.pose(placement.translation, placement.rotation),
            )
            _set_inertia(body, pinocchio.inertias[index])
        _add_joint(body, model, index)
        bodies.append(body)
    _set_inertia(base, _base_inertia(model))
    return bodies


def _add_joint(body: MjsBody, model: RobotModel, index: int) -> None:
    """Add a one-degree-of-freedom joint with the axis of pinocchio's motion subspace.

    The rotor's inertia, seen through the gear, keeps the velocity loop of a light link slower than
    `_DRIVE_TIME`: MuJoCo solves contacts before it integrates the servo implicitly, and a faster loop would
    throw what the gripper holds.
    """
    joint = model.pinocchio.joints[index]
    name = model.pinocchio.names[index]
    if joint.nq != 1 or joint.nv != 1:
        raise HandrailError(
            f"joint {name!r} of robot {model.description.name}: expected a hinge or a slide with limits, "
            f"got {joint.shortname()}"
        )
    data = joint.createData()
    joint.calc(data, np.zeros(1))
    axis = np.asarray(data.S).reshape(6)
    hinge = bool(np.any(axis[3:]))
    limited = name not in model.description.base.joints
    body.add_joint(
        name=name,
        type=mujoco.mjtJoint.mjJNT_HINGE if hinge else mujoco.mjtJoint.mjJNT_SLIDE,
        axis=axis[3:] if hinge else axis[:3],
        limited=limited,
        armature=_DRIVE_TIME * model.description.limits.servo[joint.idx_v] if limited else 0.0,
        range=[
            float(model.pinocchio.lowerPositionLimit[joint.idx_q]) if limited else 0.0,
            float(model.pinocchio.upperPositionLimit[joint.idx_q]) if limited else 0.0,
        ],
    )


def _base_inertia(model: RobotModel) -> pin.Inertia:
    """Return the chassis as a solid box, and what the URDF fixes to it."""
    description = model.description
    size = (*description.base.size, description.base.height)
    chassis = pin.Inertia.FromBox(max(description.base.mass, 1e-3), *size)
    centre = pin.SE3(np.eye(3), np.array([0.0, 0.0, description.base.height / 2]))
    fixed = model.pinocchio.inertias[len(description.base.joints)]
    return centre.act(chassis) + fixed


def _set_inertia(body: MjsBody, inertia: pin.Inertia) -> None:
    moments, axes = np.linalg.eigh(inertia.inertia)
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    body.explicitinertial = True
    body.mass = max(float(inertia.mass), 1e-3)
    body.ipos = inertia.lever
    body.inertia = np.maximum(moments, 1e-6)
    body.iquat = quaternion_from_matrix(axes)


def _add_shape(mounts: Mounts, placed: PlacedShape, **arguments: object) -> None:
    body, at = mounts.place(placed.frame, placed.placement)
    body.add_geom(
        **geometry.geom_shape(placed.shape), **geometry.pose(at.translation, at.rotation), **arguments
    )


def _add_contact_shapes(model: RobotModel, mounts: Mounts) -> tuple[str, ...]:
    """Add the description's collision shapes; real fingers stand in for the shape around them."""
    gripper = model.description.end_effector.gripper
    solid = [shape for shape in model.description.collision if not (gripper and shape.name == gripper.shape)]
    for shape in solid:
        floor = geometry.FLOOR_BIT if shape.name in floor_shapes(model) else 0
        _add_shape(
            mounts,
            shape,
            name=shape.name,
            contype=geometry.ROBOT_BIT,
            conaffinity=geometry.SCENE_BIT | floor,
            group=geometry.HIDDEN_GROUP,
            rgba=(0.9, 0.3, 0.2, 0.4),
        )
    return tuple(shape.name for shape in solid)


def _add_pairs(spec: MjSpec, model: RobotModel) -> None:
    """Let the robot touch itself only where the description says that it can."""
    description = model.description
    enclosing = description.end_effector.gripper.shape if description.end_effector.gripper else ""
    for pair in description.self_pairs:
        firsts, seconds = (FINGERS if name == enclosing else (name,) for name in pair)
        for first in firsts:
            for second in seconds:
                spec.add_pair(name=f"{first}:{second}", geomname1=first, geomname2=second)


def _add_servos(spec: MjSpec, model: RobotModel) -> None:
    """Add a velocity servo on each joint: force = gain (command − velocity), within the effort limit."""
    limits = model.description.limits
    for name, gain, effort in zip(model.joints, limits.servo, limits.effort, strict=True):
        servo = spec.add_actuator(
            name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT, forcerange=[-effort, effort]
        )
        servo.set_to_velocity(kv=gain)


def _add_meshes(
    spec: MjSpec, model: RobotModel, mounts: Mounts, jaw: tuple[str, MjsBody, pin.SE3] | None
) -> None:
    for mesh in placed_meshes(model):
        body, placement = mounts.bodies[mesh.joint], mesh.placement
        if jaw is not None and mesh.link == jaw[0]:
            body, placement = jaw[1], jaw[2].actInv(placement)
        for index, piece in enumerate(mesh.pieces):
            name = f"{mesh.name}_{index}"
            spec.add_mesh(
                name=name,
                uservert=piece.vertices.ravel(),
                userface=piece.faces.ravel(),
                inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
            )
            body.add_geom(
                name=name,
                type=mujoco.mjtGeom.mjGEOM_MESH,
                meshname=name,
                rgba=piece.rgba,
                **_ghost(geometry.VISIBLE_GROUP),
                **geometry.pose(placement.translation, placement.rotation),
            )


def _grasp_geoms(model: RobotModel, contact: tuple[str, ...]) -> tuple[str, ...]:
    gripper = model.description.end_effector.gripper
    if gripper is None:
        return ()
    palms = [s.name for s in model.description.collision if s.frame == gripper.frame and s.name in contact]
    return (*palms, *FINGERS)
