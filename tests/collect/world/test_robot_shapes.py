"""A robot's shapes: all that move are checked against the scene, all that can meet each other are listed."""

import itertools
from functools import lru_cache

import numpy as np
import pinocchio as pin
import pytest
from coal_helpers import by_coal

from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.collision.shape_pairs import FLOOR
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.robot.description import load_description, robot_names
from handrail.controllers.robot.model import RobotModel, load_model
from handrail.controllers.robot.scene_shapes import floor_shapes, lowest_height, scene_shapes
from handrail.controllers.robot.shape import Obstacle, Shape


@pytest.fixture(scope="module", params=robot_names())
def model(request) -> RobotModel:
    return load_model(request.param)


def configurations(model: RobotModel, count: int) -> np.ndarray:
    """Return random configurations within the limits, the base in the middle, (count, n)."""
    limits, base = model.description.limits, len(model.description.base.joints)
    q = np.random.default_rng(0).uniform(limits.position_lower, limits.position_upper, (count, model.size))
    q[:, :base] = 0.0
    return q


def distances(model: RobotModel, pairs: list[tuple[str, str]], q: np.ndarray) -> np.ndarray:
    """Return the signed distances of any pairs of the robot's shapes and the floor, (K, P)."""
    measure = by_coal(model, (), pairs)
    return np.array([measure(each) for each in q])


def joints(model: RobotModel) -> dict[str, int]:
    """Return the joint that carries each shape."""
    frames = model.pinocchio.frames
    return {s.name: frames[model.frame_id(s.frame)].parentJoint for s in model.description.collision}


def test_every_shape_sees_a_ball_in_it(model):
    """No shape of a robot that moves is left out."""
    home, frames = model.description.home, model.description.collision
    assert scene_shapes(model) == tuple(placed.name for placed in frames)
    for placed in frames:
        pose = model.pose(home, placed.frame)
        inside = pose.position + pose.rotation @ placed.placement.translation + 0.002
        collision = CollisionModel(model, (Obstacle("ball", Shape("sphere", [0.02]), inside),))
        assert collision.values(home[None])[0, collision.pairs.index((placed.name, "ball"))] < 0.0


def test_only_what_cannot_touch_the_floor_is_not_checked_against_it(model):
    names = list(joints(model))
    lowest = distances(model, [(name, FLOOR) for name in names], configurations(model, 3000)).min(axis=0)
    for placed, reached in zip(model.description.collision, lowest, strict=True):
        bound = lowest_height(model, placed)
        assert bound <= reached + 1e-6, placed.name
        if reached < 0.0 and placed.name != "chassis":  # which rolls on it
            assert placed.name in floor_shapes(model)
    checked = set(floor_shapes(model))
    assert checked.issuperset(hand.gripper.shape for hand in model.description.hands if hand.gripper)
    assert not {"chassis", "mount", "shoulder", "left_mount", "right_shoulder", "head"} & checked


def test_shapes_that_are_not_listed_never_meet(model):
    """Where nothing that is listed touches, nothing does, neighbours along the chain aside.

    Shapes enclose links loosely; where two that are not listed overlap, the links themselves are apart.
    """
    of, parents = joints(model), model.pinocchio.parents
    listed = {frozenset(pair) for pair in model.description.self_pairs}
    pairs = [
        (a, b)
        for a, b in itertools.combinations(of, 2)
        if frozenset((a, b)) not in listed
        and of[a] not in (of[b], parents[of[b]])
        and of[b] != parents[of[a]]
    ]
    q = configurations(model, 12000)
    q = q[distances(model, list(model.description.self_pairs), q).min(axis=1) > 0.0]
    assert len(q) > 3000
    values = distances(model, pairs, q)
    for pair, column in zip(pairs, values.T, strict=True):
        for each in q[column < 0.0][:40]:
            assert mesh_distance(model, pair, each) > 0.0, pair


@lru_cache
def meshes(model: RobotModel) -> tuple[pin.Model, pin.GeometryModel]:
    """Return the arm with the collision meshes of its URDF, other joints locked."""
    described = model.description.arms[0]
    arm = pin.buildModelFromUrdf(str(described.urdf))
    geometry = pin.buildGeomFromUrdf(
        arm, str(described.urdf), pin.COLLISION, package_dirs=[str(described.mesh_root)]
    )
    locked = [arm.getJointId(name) for name in list(arm.names)[1:] if name not in described.joints]
    return pin.buildReducedModel(arm, geometry, locked, pin.neutral(arm))


def mesh_distance(model: RobotModel, pair: tuple[str, str], q: np.ndarray) -> float:
    """Return how far the meshes of the links that two shapes enclose are apart; −∞ for what has no mesh."""
    arm, geometry = meshes(model)
    frames = {placed.name: placed.frame for placed in model.description.collision}
    links = [own_meshes(arm, geometry, frames[name]) for name in pair]
    if not all(links) or "fingers" in pair:
        return -np.inf
    geometry.removeAllCollisionPairs()
    for each in itertools.product(*links):
        geometry.addCollisionPair(pin.CollisionPair(*each))
    data = pin.GeometryData(geometry)
    pin.computeDistances(arm, arm.createData(), geometry, data, q[-arm.nq :])
    return min(found.min_distance for found in data.distanceResults)


def own_meshes(arm: pin.Model, geometry: pin.GeometryModel, frame: str) -> list[int]:
    """Return the mesh of a frame's link, or where it has none, those of all that its joint carries."""
    if geometry.existGeometryName(f"{frame}_0"):
        return [geometry.getGeometryId(f"{frame}_0")]
    joint = arm.frames[arm.getFrameId(frame)].parentJoint if arm.existFrame(frame) else -1
    return [index for index, each in enumerate(geometry.geometryObjects) if each.parentJoint == joint]


@pytest.mark.parametrize("entry", ["scene", "floor"])
def test_a_file_with_a_list_of_its_own_is_refused(tmp_path, entry):
    text = ROBOTS["ridgeback_ur10"].file.read_text()
    path = tmp_path / "robot.toml"
    path.write_text(text.replace("[self_collision]", f'[self_collision]\n{entry} = ["chassis"]', 1))
    with pytest.raises(HandrailError, match=rf"robot.toml: .*unknown entry '{entry}'"):
        load_description(path)
