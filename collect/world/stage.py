"""A scene in MuJoCo: what stands around the robot, and what all of it stands on and is lit by."""

from pathlib import Path
from typing import Any

import numpy as np

from handrail.collect.world import geometry
from handrail.collect.world.gl import MjsBody, MjSpec, mujoco
from handrail.collect.world.scene import Scene, SceneObject, Viewpoint
from handrail.controllers.errors import restated
from handrail.controllers.robot.description import SCENE_CAMERA


def new_stage(looks: bool) -> MjSpec:
    """Return a floor; with sky, lights and a pattern where it will be looked at."""
    name = "looks.xml" if looks else "stage.xml"
    spec = mujoco.MjSpec.from_file(str(Path(__file__).parent / name))
    if looks:
        spec.geom("floor").material = "floor"
    return spec


def add_scene(spec: MjSpec, scene: Scene) -> None:
    """Add the objects and the scene camera to the spec of a robot."""
    taken = {part.name for part in (*spec.bodies, *spec.geoms, *spec.joints)} - {"world", "floor"}
    for item in scene.objects:
        blamed = thing = f"the task's {item.name!r}"
        if taken & {item.name, *(f"{item.name}_{index}" for index in range(len(item.solids)))}:
            own = f"robot {spec.modelname}: expected no shape or joint called as"
            blamed = f"{own} {thing}; rename it in its description"
        with restated(blamed, ValueError):
            _add_object(spec, item)
    spec.worldbody.add_camera(name=SCENE_CAMERA, fovy=scene.view.fovy, **_view_pose(scene.view))


def _add_object(spec: MjSpec, item: SceneObject) -> None:
    placement = geometry.pose(item.position, item.rotation)
    body = spec.worldbody.add_body(name=item.name, mocap=item.patrol is not None, **placement)
    if item.movable:
        _add_freedom(body, item)
    volume = sum(geometry.volume(part.shape) for part in item.parts)
    for index, part in enumerate(item.solids):
        body.add_geom(
            name=item.name if index == 0 else f"{item.name}_{index}",
            mass=item.mass * geometry.volume(part.shape) / volume if item.parts else 0.0,
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
            stiffness=[float(item.slide.closing > 0.0), 0.0, 0.0],
            springref=-item.slide.closing,  # far beyond the stop: the force hardly changes on the way
        )
    if not item.parts:
        geometry.set_box_inertia(body, item.mass, geometry.bounding_box(item.shape))


def _contact(item: SceneObject) -> dict[str, Any]:
    if item.ghost:
        return geometry.UNTOUCHED
    floor = geometry.FLOOR_BIT if item.movable else 0
    bits = {"contype": geometry.SCENE_BIT, "conaffinity": geometry.SCENE_BIT | floor}
    return {**bits, "condim": 4, "friction": [item.friction, 0.01, 0.0001]}


def _view_pose(view: Viewpoint) -> dict[str, Any]:
    position = np.array(view.position)
    forward = np.array(view.target) - position
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right = right / np.linalg.norm(right) if np.any(right) else np.array([0.0, -1.0, 0.0])
    return geometry.camera_pose(position, right, forward)
