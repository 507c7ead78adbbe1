"""Fetch a cube from one table and put it into a bin on another, past obstacles on the floor."""

from dataclasses import dataclass

import numpy as np

from handrail.collect.world.scene import Scene, SceneObject, Viewpoint
from handrail.collect.world.task import Aim, Start, TaskState, Verdict, near_home
from handrail.collect.world.tasks.furniture import (
    cube,
    obstacle_features,
    obstacle_names,
    open_bin,
    sample_obstacles,
    table,
)
from handrail.controllers.arrays import FloatArray
from handrail.controllers.numerics.rotation import quaternion_from_matrix
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.parts import WorldScale

_MASS = 0.1  # of a cube of 5 cm [kg]
_BIN_HEIGHT = 0.10
_POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")
_STAGES = ("approach", "grasp", "lift", "carry", "place")
_AT, _AROUND, _LIFTED = (
    2.0,
    1.0,
    0.5,
)  # of the cube's width: the hand is there, around it; it is off the table
_ABOVE = 0.05  # the rim is let go, at scale 1 [m]
_OPEN = 0.8  # share of the stroke from which the gripper is open
_VIEW = Viewpoint(position=(3.0, 0.0, 3.5), target=(0.05, 0.0, 0.2), fovy=56.0)


@dataclass(frozen=True)
class PickPlace:
    """The tables are 2.7 m · scale apart, farther than the arm reaches, so the base has to drive.

    Success: the cube at rest inside the bin, the gripper open and away from it.
    Failure: the cube on the floor.

    Attributes:
        description: what the operator is asked to do.
        horizon: time limit [s].
        clearance: between the robot's start and anything on the floor, and between obstacles, at scale 1 [m].
    """

    description: str = "Pick up the cube and put it into the bin on the other table."
    horizon: float = 90.0
    clearance: float = 0.15

    @property
    def state_names(self) -> tuple[str, ...]:
        """Cube pose, bin centre, the tables' top centres, obstacles (absent ones are all zero)."""
        names = [f"cube.{axis}" for axis in _POSE]
        names += [f"{item}.{axis}" for item in ("bin", "cube_table", "bin_table") for axis in "xyz"]
        return (*names, *obstacle_names())

    def sample(self, model: RobotModel, rng: np.random.Generator) -> Start:
        """Draw tables, cube, bin, obstacles and the robot's start."""
        side, world = rng.choice([-1.0, 1.0]), model.description.world
        cube_table = _sample_table("cube_table", side, world, rng)
        bin_table = _sample_table("bin_table", -side, world, rng)
        q = near_home(model, rng)
        objects = (
            cube_table,
            bin_table,
            _sample_cube(cube_table, world, rng),
            _sample_bin(bin_table, world, rng),
            *sample_obstacles(model, q, rng, self.clearance),
        )
        return Start(Scene(objects, _VIEW.scaled(world.scale)), q)

    def features(self, state: TaskState) -> FloatArray:
        """Return the numbers that `state_names` names, (28,)."""
        pose = state.pose("cube")
        numbers = [*pose.position, *quaternion_from_matrix(pose.rotation), *state.pose("bin").position]
        for name in ("cube_table", "bin_table"):
            item = state.object(name)
            numbers += [item.position[0], item.position[1], item.top]
        return np.concatenate([numbers, obstacle_features(state.start.scene)])

    @property
    def stages(self) -> tuple[str, ...]:
        """What is done one after the other."""
        return _STAGES

    def stage(self, state: TaskState) -> str:
        """Return what is to be done: get to the cube, close around it, lift it, go over the bin, let go."""
        cube, start = state.pose("cube").position, state.object("cube")
        width, away = start.shape.size[0], float(np.linalg.norm(state.tool.position - cube))
        if _over_bin(state, cube):
            return "place"
        if cube[2] > start.position[2] + _LIFTED * width:
            return "carry"
        if away > _AT * width:
            return "approach"
        return "lift" if away < _AROUND * width and state.opening < _OPEN else "grasp"

    def aim(self, state: TaskState) -> Aim:
        """Return the cube, from above; once it is in hand, the place above the bin to let it go."""
        if self.stage(state) in _STAGES[:2]:
            cube = state.pose("cube")
            return Aim("cube", cube.position, grasp_rotation(state.tool.rotation, cube.rotation))
        position = np.array(state.pose("bin").position)
        position[2] = state.object("bin").top + _ABOVE * state.scale
        return Aim("bin", position)

    def outcome(self, state: TaskState) -> Verdict:
        """Judge where the cube is, whether it rests, and where the gripper is."""
        position = state.pose("cube").position
        if position[2] < 2 * state.object("cube").shape.size[0]:
            return Verdict(failure="dropped")
        rests = _inside_bin(state, position) and "cube" in state.still
        return Verdict(success=rests and state.let_go(position))


def grasp_rotation(tool: FloatArray, cube: FloatArray) -> FloatArray:
    """Return the rotation nearest to the tool's that points it down, fingers square to the cube, (3, 3)."""
    yaw, down = np.arctan2(cube[1, 0], cube[0, 0]), np.array([0.0, 0.0, -1.0])
    ahead = [np.array([np.cos(angle), np.sin(angle), 0.0]) for angle in yaw + np.pi / 2 * np.arange(4)]
    candidates = [np.column_stack([x, np.cross(down, x), down]) for x in ahead]
    return max(candidates, key=lambda rotation: float(np.trace(rotation.T @ tool)))


def _sample_table(name: str, side: float, world: WorldScale, rng: np.random.Generator) -> SceneObject:
    scale = world.scale
    x, y = 1.05 + rng.uniform(-0.05, 0.05), side * 1.35 + rng.uniform(-0.05, 0.05)
    return table(name, scale * x, scale * y, (scale * 0.6, scale * 0.7, rng.uniform(*world.tables)), scale)


def _sample_cube(on: SceneObject, world: WorldScale, rng: np.random.Generator) -> SceneObject:
    x = on.front + world.scale * rng.uniform(0.10, 0.20)
    y = on.position[1] + world.scale * rng.uniform(-0.15, 0.15)
    yaw = rng.uniform(-np.pi / 4, np.pi / 4)  # a cube looks the same every quarter turn
    return cube("cube", x, y, on.top, yaw, world.cube, _MASS * world.grip**3)


def _sample_bin(on: SceneObject, world: WorldScale, rng: np.random.Generator) -> SceneObject:
    scale = world.scale
    inner = scale * rng.uniform(0.24, 0.28)
    x = on.front + inner / 2 + scale * rng.uniform(0.04, 0.10)
    y = on.position[1] + scale * rng.uniform(-0.12, 0.12)
    return open_bin("bin", x, y, on.top, inner, scale * _BIN_HEIGHT, scale)


def _inside_bin(state: TaskState, position: FloatArray) -> bool:
    pose, size = state.pose("bin"), state.object("bin").shape.size
    local = pose.rotation.T @ (position - pose.position)
    return bool(np.all(np.abs(local) < size / 2))


def _over_bin(state: TaskState, position: FloatArray) -> bool:
    """Return whether a place is within the bin, or anywhere above it."""
    pose, size = state.pose("bin"), state.object("bin").shape.size
    local = pose.rotation.T @ (position - pose.position)
    return bool(np.all(np.abs(local[:2]) < size[:2] / 2) and local[2] > -size[2] / 2)
