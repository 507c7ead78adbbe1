"""A scene in MuJoCo: what stands around the robot, and what all of it stands on and is lit by."""

from typing import Any

import numpy as np

from handrail.collect.world import geometry
from handrail.collect.world.gl import MjsBody, MjsGeom, MjSpec, mujoco
from handrail.collect.world.scene import Scene, SceneObject, Viewpoint
from handrail.controllers.arrays import FloatArray


def set_stage(spec: MjSpec, timestep: float, looks: bool) -> None:
    """Add floor, sky and lights, and set how the simulation integrates.

    Args:
        spec: the spec to add to.
        timestep: of the integrator [s].
        looks: whether it will be looked at; sky, lights and the floor's pattern take time in every step.
    """
    spec.option.timestep = timestep
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 20.0
    spec.stat.extent = 3.0
    spec.stat.center = [0.0, 0.0, 0.5]
    floor = _add_floor(spec)
    if looks:
        _set_quality(spec)
        _add_sky(spec)
        _add_pattern(spec, floor)
        _add_lights(spec)


def _set_quality(spec: MjSpec) -> None:
    visual = spec.visual
    visual.headlight.ambient = [0.35, 0.35, 0.37]
    visual.headlight.diffuse = [0.25, 0.25, 0.25]
    visual.headlight.specular = [0.05, 0.05, 0.05]
    visual.map.znear = 0.005
    visual.map.zfar = 20.0
    visual.map.shadowclip = 1.6
    visual.rgba.haze = [0.82, 0.87, 0.92, 1.0]


def _add_sky(spec: MjSpec) -> None:
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.86, 0.91, 0.96],
        rgb2=[0.45, 0.58, 0.72],
        width=64,
        height=64,
    )


def _add_floor(spec: MjSpec) -> MjsGeom:
    return spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[8.0, 8.0, 0.1],
        contype=geometry.FLOOR_BIT,
        conaffinity=0,
        friction=[0.8, 0.01, 0.0001],
        group=geometry.VISIBLE_GROUP,
    )


def _add_pattern(spec: MjSpec, floor: MjsGeom) -> None:
    spec.add_texture(
        name="checker",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        mark=mujoco.mjtMark.mjMARK_EDGE,
        rgb1=[0.78, 0.79, 0.80],
        rgb2=[0.70, 0.71, 0.73],
        markrgb=[0.60, 0.61, 0.63],
        width=128,
        height=128,
    )
    textures = [""] * int(mujoco.mjtTextureRole.mjNTEXROLE)
    textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "checker"
    spec.add_material(name="floor", textures=textures, texrepeat=[1.0, 1.0], texuniform=True, reflectance=0.0)
    floor.material = "floor"


def _add_lights(spec: MjSpec) -> None:
    for name, position, diffuse, shadow in (
        ("sun", (1.6, -2.0, 4.5), 0.55, True),
        ("fill", (-3.0, 3.0, 5.0), 0.20, False),
    ):
        spec.worldbody.add_light(
            name=name,
            type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
            pos=position,
            dir=[-value for value in position],
            diffuse=[diffuse] * 3,
            specular=[0.2 * shadow] * 3,
            castshadow=shadow,
        )


def add_scene(spec: MjSpec, scene: Scene) -> None:
    """Add the objects and the scene camera to the spec."""
    for item in scene.objects:
        _add_object(spec, item)
    spec.worldbody.add_camera(name="scene", fovy=scene.view.fovy, **_view_pose(scene.view))


def _add_object(spec: MjSpec, item: SceneObject) -> None:
    placement = geometry.pose(item.position, item.rotation)
    body = spec.worldbody.add_body(name=item.name, mocap=item.patrol is not None, **placement)
    if item.movable:
        _add_freedom(body, item)
    volume = sum(geometry.volume(part.shape) for part in item.parts)
    for index, part in enumerate(item.solids):
        mass = item.mass * geometry.volume(part.shape) / volume if item.parts else 0.0
        body.add_geom(
            mass=mass,
            name=item.name if index == 0 else f"{item.name}_{index}",
            rgba=part.rgba or item.rgba,
            group=geometry.VISIBLE_GROUP,
            **geometry.geom_shape(part.shape),
            **geometry.pose(part.position, part.rotation),
            **_contact(item),
        )


def _add_freedom(body: MjsBody, item: SceneObject) -> None:
    """Let a movable thing move; its mass is spread over its parts, or over the box around it."""
    if item.slide is None:
        body.add_freejoint(name=item.name)
    else:
        body.add_joint(
            name=item.name,
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=item.slide.axis,
            limited=True,
            range=[0.0, item.slide.travel],
            damping=[item.slide.damping, 0.0, 0.0],
            frictionloss=item.slide.friction,
        )
    if not item.parts:
        geometry.set_box_inertia(body, item.mass, geometry.bounding_box(item.shape))


def _contact(item: SceneObject) -> dict[str, Any]:
    if item.ghost:
        return {"contype": 0, "conaffinity": 0}
    return {
        "contype": geometry.SCENE_BIT,
        "conaffinity": geometry.SCENE_BIT | (geometry.FLOOR_BIT if item.movable else 0),
        "condim": 4,
        "friction": [item.friction, 0.01, 0.0001],
    }


def _view_pose(view: Viewpoint) -> dict[str, FloatArray]:
    """Return the pose of a camera that looks along −z with y up."""
    position = np.array(view.position)
    forward = np.array(view.target) - position
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right = right / np.linalg.norm(right) if np.any(right) else np.array([0.0, -1.0, 0.0])
    axes = np.column_stack([right, np.cross(right, forward), -forward])
    return geometry.pose(position, axes.astype(np.float64))
