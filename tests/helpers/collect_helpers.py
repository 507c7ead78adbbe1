"""Shared by the tests of collect/: environments that are closed, poses that are reached, a second robot."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from scipy.spatial.transform import Rotation

import handrail.collect  # noqa: F401  (registers the environments)
from handrail.collect.world.env import HandrailEnv
from handrail.collect.world.scene import Scene, SceneObject
from handrail.collect.world.task import Start
from handrail.controllers.robot.model import RobotModel

UP = np.array([0.0, 0.0, 1.0])
DOWN = np.diag([1.0, -1.0, -1.0])  # tool pointing at the floor


@contextmanager
def environment(name: str = "PickPlace", **options: Any) -> Iterator[HandrailEnv]:
    env = gymnasium.make(f"handrail/{name}-v0", **options).unwrapped
    assert isinstance(env, HandrailEnv)
    try:
        yield env
    finally:
        env.close()


def action(env: HandrailEnv, velocity: Any = 0.0, gripper: float = 0.0) -> np.ndarray:
    return np.append(np.zeros(env.model.size) + velocity, gripper).astype(np.float32)


def reach(model: RobotModel, q: np.ndarray, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Move the arm's joints until the tool is there."""
    q, arm = q.copy(), slice(len(model.description.base.joints), model.size)
    for _ in range(300):
        pose = model.pose(q)
        turn = Rotation.from_matrix(rotation @ pose.rotation.T).as_rotvec()
        error = np.concatenate([position - pose.position, turn])
        J = model.jacobian(q)[:, arm]
        q[arm] += np.clip(J.T @ np.linalg.solve(J @ J.T + 1e-4 * np.eye(6), error), -0.1, 0.1)
    assert np.abs(error).max() < 1e-6
    return q


def over_cube(env: HandrailEnv, seed: int, height: float) -> Start:
    """Return the seed's episode with the open gripper `height` above the cube's centre, pointing down."""
    env.reset(seed=seed)
    state = env.task_state()
    cube = state.pose("cube")
    q = np.array([cube.position[0] - 1.05, cube.position[1], 0.0, 1.57, -1.2, 1.8, -2.2, -1.57, 0.0])
    q = reach(env.model, q, cube.position + height * UP, cube.rotation @ DOWN)
    return Start(state.start.scene, q)


def moved(episode: Start, name: str, position: Any) -> Start:
    """Return the episode with an object somewhere else."""

    def move(item: SceneObject) -> SceneObject:
        return replace(item, position=np.array(position), rotation=np.eye(3)) if item.name == name else item

    scene = Scene(tuple(move(item) for item in episode.scene.objects), episode.scene.view)
    return Start(scene, episode.q, episode.goal)


SMALL_ROBOT = """
name = "small_ur5"

[base]
kind = "planar"
mass = 60.0
height = 0.30
size = [0.6, 0.5]

[arm]
urdf = "example-robot-data/robots/ur_description/urdf/ur5_robot.urdf"
translation = [0.1, 0.0, 0.30]
joints = [
    "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint",
    "wrist_1_joint", "wrist_2_joint", "wrist_3_joint",
]

[tool]
frame = "tool0"
translation = [0.0, 0.0, 0.15]

[home]
q = [-1.5, 0.0, 0.0, 0.0, -1.5708, 1.2, -1.2, -1.5708, 0.0]

[limits]
position_lower = [-3.0, -3.0, -6.3, -6.3, -6.3, -3.1, -6.3, -6.3, -6.3]
position_upper = [3.0, 3.0, 6.3, 6.3, 6.3, 3.1, 6.3, 6.3, 6.3]
velocity = [0.8, 0.8, 0.8, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0]
acceleration = [1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0]
effort = [800.0, 800.0, 400.0, 150.0, 150.0, 150.0, 28.0, 28.0, 28.0]
servo = [20000.0, 20000.0, 4000.0, 1500.0, 1500.0, 1000.0, 300.0, 300.0, 200.0]

[gripper]
frame = "tool0"
mass = 0.5
finger_mass = 0.05
finger_size = [0.01, 0.02, 0.08]
stroke = 0.08
tip = 0.16
force = 30.0
speed = 0.1
friction = 1.0
camera = [0.0, -0.08, 0.02]
camera_tilt = 0.4

[[collision]]
name = "body"
frame = "planar_base"
box = [0.6, 0.5, 0.30]
at = [0.0, 0.0, 0.15]

[[collision]]
name = "forearm"
frame = "forearm_link"
capsule = 0.07
a = [0.0, 0.0, 0.0]
b = [0.0, 0.0, 0.39]

[[collision]]
name = "palm"
frame = "tool0"
capsule = 0.04
a = [0.0, 0.0, 0.0]
b = [0.0, 0.0, 0.03]

[[collision]]
name = "fingers"
frame = "tool0"
box = [0.10, 0.02, 0.09]
at = [0.0, 0.0, 0.12]
tool = true

[self_collision]
pairs = [["body", "forearm"], ["body", "palm"], ["body", "fingers"]]

[[visual]]
frame = "planar_base"
box = [0.6, 0.5, 0.2]
at = [0.0, 0.0, 0.2]
"""


def write_small_robot(folder: Path) -> Path:
    path = folder / "small_ur5.toml"
    path.write_text(SMALL_ROBOT)
    return path
