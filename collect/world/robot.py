"""MuJoCo's robot, built from the very model that pinocchio and CasADi use.

Every joint placement, axis and inertia comes from the pinocchio model, every contact shape from the robot
description, so that the simulated robot and the controller's cannot drift apart.
"""

import numpy as np
import pinocchio as pin

from handrail.collect.world import geometry
from handrail.collect.world.gl import MjsBody, MjSpec, mujoco
from handrail.collect.world.gripper import add_gripper, fingers
from handrail.collect.world.meshes import placed_meshes
from handrail.collect.world.stage import new_stage
from handrail.controllers.errors import HandrailError
from handrail.controllers.numerics.rotation import quaternion_from_matrix
from handrail.controllers.robot.model import RobotModel, joints_of
from handrail.controllers.robot.parts import EndEffector, PlacedShape, Placement
from handrail.controllers.robot.scene_shapes import floor_shapes

BASE_BODY = "planar_base"
_DRIVE_TIME = 0.0025  # [s]
_AT_FRAME = Placement(np.zeros(3), np.eye(3))


def build_robot(model: RobotModel, meshes: bool = True, grips: bool = True) -> MjSpec:
    """Build the robot on an empty floor; without `meshes` it moves and collides alike.

    Args:
        model: of the robot.
        meshes: whether to draw it, and what it stands on, as they look.
        grips: whether its fingers move; else they stay open.
    """
    spec = new_stage(meshes)
    spec.modelname = model.description.name
    bodies = _add_bodies(spec, model)
    for hand in model.description.hands:
        tool = model.pinocchio.frames[model.frame_id(hand.named("tool"))]
        at = geometry.pose(tool.placement.translation, tool.placement.rotation)
        bodies[tool.parentJoint].add_site(name=hand.named("tool"), group=4, **at)
    _add_contact_shapes(model, bodies)
    for camera in model.description.cameras:
        joint, at = _place(model, camera.frame, Placement(np.array(camera.position), camera.axes))
        pose = geometry.pose(at.translation, at.rotation)
        bodies[joint].add_camera(name=camera.name, fovy=camera.fovy, **pose)
    jaws = [_add_hand(spec, model, hand, bodies, grips) for hand in model.description.hands]
    _add_pairs(spec, model)
    _add_servos(spec, model)
    if meshes:
        _add_meshes(spec, model, bodies, {jaw[0]: jaw[1:] for jaw in jaws if jaw})
    return spec


def grasp_geoms(model: RobotModel) -> tuple[str, ...]:
    """Return the names of the geoms that may touch movable things: palms and fingers."""
    found: list[str] = []
    for hand in model.description.hands:
        if gripper := hand.gripper:
            found += [shape.name for shape in _solid(model) if shape.frame == gripper.frame]
            found += fingers(hand)
    return tuple(found)


def _add_hand(
    spec: MjSpec, model: RobotModel, hand: EndEffector, bodies: list[MjsBody], grips: bool
) -> tuple[str, MjsBody, pin.SE3] | None:
    """Add a hand's gripper; return the URDF's link that turns, its body, and its zero on the hand's body."""
    if (gripper := hand.gripper) is None:
        return None
    joint, frame = _place(model, gripper.frame, gripper.placement)
    if gripper.jaw is None:
        add_gripper(spec, hand, bodies[joint], frame, None, grips)
        return None
    carrier, zero = _place(model, gripper.jaw.frame, _AT_FRAME)
    if carrier != joint:
        raise HandrailError(
            f"jaw of robot {model.description.name}: expected a frame on the link of {gripper.frame!r}, "
            f"got {gripper.jaw.frame!r}"
        )
    return gripper.jaw.frame, add_gripper(spec, hand, bodies[joint], frame, zero, grips), zero


def _place(model: RobotModel, frame: str, placement: Placement) -> tuple[int, pin.SE3]:
    """Return the joint whose body carries something placed on a frame, and where that is on the body."""
    mount = model.pinocchio.frames[model.frame_id(frame)]
    on_frame = pin.SE3(np.array(placement.rotation), np.array(placement.translation))
    return mount.parentJoint, mount.placement * on_frame


def _add_bodies(spec: MjSpec, model: RobotModel) -> list[MjsBody]:
    """Add one body for the base and one for each arm joint; return them by pinocchio's joint index."""
    pinocchio, on_base = model.pinocchio, len(model.description.base.joints)
    base = spec.worldbody.add_body(name=BASE_BODY)
    bodies = [base]
    for index in range(1, pinocchio.njoints):
        body = base
        if index > on_base:
            at = pinocchio.jointPlacements[index]
            body = bodies[pinocchio.parents[index]].add_body(
                name=f"{pinocchio.names[index]}_body",
                gravcomp=1.0,
                **geometry.pose(at.translation, at.rotation),
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
    robot, joint, name = model.pinocchio, joints_of(model)[index - 1], model.joints[index - 1]
    ends, armature = [0.0, 0.0], 0.0
    limited = name not in model.description.base.joints
    if limited:
        ends = [float(end[index - 1]) for end in (robot.lowerPositionLimit, robot.upperPositionLimit)]
        armature = _DRIVE_TIME * model.description.limits.servo[index - 1]
    body.add_joint(
        name=name,
        type=mujoco.mjtJoint.mjJNT_SLIDE if joint.prismatic else mujoco.mjtJoint.mjJNT_HINGE,
        axis=joint.axis,
        limited=limited,
        armature=armature,
        range=ends,
    )


def _base_inertia(model: RobotModel) -> pin.Inertia:
    """Return the chassis as a solid box, and what the URDF fixes to it."""
    base = model.description.base
    chassis = pin.Inertia.FromBox(max(base.mass, 1e-3), *base.size, base.height)
    centre = pin.SE3(np.eye(3), np.array([0.0, 0.0, base.height / 2]))
    return centre.act(chassis) + model.pinocchio.inertias[len(base.joints)]


def _set_inertia(body: MjsBody, inertia: pin.Inertia) -> None:
    moments, axes = np.linalg.eigh(inertia.inertia)
    moments = np.maximum(moments, 1e-6)
    moments[2] = min(moments[2], moments[0] + moments[1])  # more is of no solid; MuJoCo refuses it
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    body.explicitinertial = True
    body.mass, body.ipos = max(float(inertia.mass), 1e-3), inertia.lever
    body.inertia, body.iquat = moments, quaternion_from_matrix(axes)


def _solid(model: RobotModel) -> list[PlacedShape]:
    """Return the description's collision shapes; real fingers stand in for the shape around them."""
    grippers = [hand.gripper.shape for hand in model.description.hands if hand.gripper]
    return [shape for shape in model.description.collision if shape.name not in grippers]


def _add_shape(model: RobotModel, bodies: list[MjsBody], placed: PlacedShape, **options: object) -> None:
    joint, at = model.mount(placed)
    pose = geometry.pose(at.translation, at.rotation)
    bodies[joint].add_geom(**geometry.geom_shape(placed.shape), **pose, **options)


def _add_contact_shapes(model: RobotModel, bodies: list[MjsBody]) -> None:
    for shape in _solid(model):
        floor = geometry.FLOOR_BIT if shape.name in floor_shapes(model) else 0
        _add_shape(
            model,
            bodies,
            shape,
            name=shape.name,
            contype=geometry.ROBOT_BIT,
            conaffinity=geometry.SCENE_BIT | floor,
            group=geometry.HIDDEN_GROUP,
            rgba=(0.9, 0.3, 0.2, 0.4),
        )


def _add_pairs(spec: MjSpec, model: RobotModel) -> None:
    """Let the robot touch itself only where the description says that it can."""
    real = {hand.gripper.shape: fingers(hand) for hand in model.description.hands if hand.gripper}
    for pair in model.description.self_pairs:
        firsts, seconds = (real.get(name, (name,)) for name in pair)
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
    spec: MjSpec, model: RobotModel, bodies: list[MjsBody], jaws: dict[str, tuple[MjsBody, pin.SE3]]
) -> None:
    """Draw the arm's links by their meshes, and the shapes that the description adds to look at."""
    ghost = {**geometry.UNTOUCHED, "group": geometry.VISIBLE_GROUP}
    for mesh in placed_meshes(model):
        body, at = bodies[mesh.joint], mesh.placement
        if mesh.link in jaws:
            body, zero = jaws[mesh.link]
            at = zero.actInv(at)
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
                **ghost,
                **geometry.pose(at.translation, at.rotation),
            )
    for index, shape in enumerate(model.description.visual):
        _add_shape(model, bodies, shape, name=f"visual_{index}", rgba=shape.rgba, **ghost)
