"""PR2 and Baxter from their URDFs: a pair keeps any two links apart whose meshes can meet."""

import itertools
from collections import Counter

import numpy as np
import pinocchio as pin
import pytest

from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.modelling.making import RobotMaker
from handrail.controllers.modelling.source import Source
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.urdf import urdf_text

ROBOTS = "example-robot-data/robots"
MADE = {
    "pr2": ("urdf/pr2.urdf", {"left": "l_gripper_tool_frame", "right": "r_gripper_tool_frame"}, 2),
    "baxter": ("urdf/baxter.urdf", {"left": "left_gripper", "right": "right_gripper"}, 8),
}
POSTURES = 400


def meetings(model: RobotModel, source: Source, q: np.ndarray) -> list[set[frozenset[int]]]:
    """Return at each q which bodies' meshes meet, by pinocchio on the whole URDF, fingers open or closed."""
    text = urdf_text(source.arm)
    urdf = pin.buildModelFromXML(text, mimic=True)
    meshes = pin.buildGeomFromUrdfString(urdf, text, pin.COLLISION, package_dirs=[str(source.arm.mesh_root)])
    frames = [urdf.frames[each.parentFrame].name for each in meshes.geometryObjects]
    bodies = [
        model.pinocchio.frames[model.pinocchio.getFrameId(f, pin.FrameType.BODY)].parentJoint for f in frames
    ]
    for i, j in itertools.combinations(range(len(bodies)), 2):
        first, last = sorted((bodies[i], bodies[j]))
        if first != last and model.pinocchio.parents[last] != first:
            meshes.addCollisionPair(pin.CollisionPair(i, j))
    data, results, found = urdf.createData(), meshes.createData(), []
    for number, each in enumerate(q):
        posture = pin.neutral(urdf)
        for name, joint in zip(list(urdf.names)[1:], urdf.joints[1:], strict=True):
            if name in model.joints:
                posture[joint.idx_q] = each[model.joints.index(name)]
            elif "gripper" in name:
                posture[joint.idx_q] = (number % 2) * urdf.upperPositionLimit[joint.idx_q]
        pin.computeCollisions(urdf, data, meshes, results, posture, False)
        hits = zip(meshes.collisionPairs, results.collisionResults, strict=True)
        found.append({frozenset((bodies[p.first], bodies[p.second])) for p, hit in hits if hit.isCollision()})
    return found


@pytest.mark.slow
@pytest.mark.parametrize("robot", MADE)
def test_where_meshes_meet_a_listed_pair_does(robot):
    """But for bodies that are built into each other: their meshes touch in about half of the postures."""
    file, hands, built_in = MADE[robot]
    source = Source.find(f"{ROBOTS}/{robot}_description/{file}")
    model = RobotMaker(source, robot, hands, "planar").make().model()
    limits = model.description.limits
    q = np.random.default_rng(5).uniform(limits.position_lower, limits.position_upper, (POSTURES, model.size))
    q[:, :3] = 0.0
    met = meetings(model, source, q)
    counts = Counter(pair for each in met for pair in each)
    nested = {pair for pair, count in counts.items() if count > 0.4 * POSTURES}
    assert len(nested) == built_in
    assert len(counts) > 20
    carrier = {placed.name: model.mount(placed)[0] for placed in model.description.collision}
    listed = [frozenset(carrier[name] for name in pair) for pair in model.description.self_pairs]
    own = CollisionModel(model).values(q)[:, : len(listed)]
    for bodies, distances in zip(met, own, strict=True):
        assert bodies - nested <= {listed[index] for index in np.flatnonzero(distances < 0.0)}
