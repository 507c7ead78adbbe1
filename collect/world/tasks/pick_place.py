"""Fetch a cube from one table and put it into a bin on another, past obstacles on the floor."""

from dataclasses import dataclass

import numpy as np

from handrail.collect.world.observation import names_of, pose_names, pose_numbers
from handrail.collect.world.scene import Scene, SceneObject, Viewpoint
from handrail.collect.world.task import OPEN, Aim, Start, Task, TaskState, Verdict
from handrail.collect.world.tasks.furniture import cube, open_bin, table
from handrail.collect.world.tasks.obstacles import obstacle_features, obstacle_names, sample_obstacles
from handrail.collect.world.tasks.postures import hand_rotation, near_home, nearest_rotation
from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.parts import WorldScale

_MASS = 0.1  # of a cube of 5 cm [kg]
_SLIM = 0.7  # width of a bar, which two hands have to find, over a cube's
_BIN_HEIGHT = 0.10
_AT, _AROUND, _LIFTED = 2.0, 1.0, 0.5  # of the cube's width: hand there, around it; it is off the table
_ABOVE = 0.05  # the rim is let go, at scale 1 [m]
_VIEW = Viewpoint(position=(3.0, 0.0, 3.5), target=(0.05, 0.0, 0.2), fovy=56.0)


@dataclass(frozen=True)
class PickPlace(Task):
    """The tables are 2.7 m · scale apart, farther than the arm reaches, so the base has to drive.

    Success: the cube at rest inside the bin, the gripper open and away from it.
    Failure: the cube on the floor.
    """

    description: str = "Pick up the cube and put it into the bin on the other table."
    time_limit: float = 90.0  # [s]
    length: float = 0.0
    """Of the cube along its y, where it is a bar; the bin is larger by half of that [m]."""
    stages = ("approach", "grasp", "lift", "carry", "place")

    @property
    def state_names(self) -> tuple[str, ...]:
        """Cube pose, bin centre, the tables' top centres, obstacles (absent ones are all zero)."""
        tables = (*names_of("cube_table"), *names_of("bin_table"))
        return (*pose_names("cube"), *names_of("bin"), *tables, *obstacle_names())

    def sample(self, model: RobotModel, rng: np.random.Generator) -> Start:
        """Draw tables, cube, bin, obstacles and the robot's start."""
        side, world = rng.choice([-1.0, 1.0]), model.description.world
        tables = _sample_table("cube_table", side, world, rng), _sample_table("bin_table", -side, world, rng)
        q = near_home(model, rng)
        things = (
            _sample_cube(tables[0], world, rng, self.length),
            _sample_bin(tables[1], world, rng, self.length),
        )
        objects = (*tables, *things, *sample_obstacles(model, q, rng))
        return Start(Scene(objects, _VIEW.scaled(world.scale)), q)

    def features(self, state: TaskState) -> FloatArray:
        """Return the numbers that `state_names` names, (28,)."""
        numbers = [pose_numbers(state.pose("cube")), state.pose("bin").position]
        numbers += [state.object(name).top_centre for name in ("cube_table", "bin_table")]
        return np.concatenate([*numbers, obstacle_features(state.start.scene)])

    def stage(self, state: TaskState) -> str:
        """Return what is to be done: get to the cube, close around it, lift it, go over the bin, let go."""
        cube, start = state.pose("cube").position, state.object("cube")
        width, away = start.shape.size[0], float(np.linalg.norm(state.tool.position - cube))
        local, half = _in_bin(state, cube)
        if np.all(np.abs(local[:2]) < half[:2]) and local[2] > -half[2]:  # in the bin, or anywhere above it
            return "place"
        if cube[2] > start.position[2] + _LIFTED * width:
            return "carry"
        if away > _AT * width:
            return "approach"
        return "lift" if away < _AROUND * width and state.opening < OPEN else "grasp"

    def aim(self, state: TaskState) -> Aim:
        """Return the cube, from above; once it is in hand, the place above the bin to let it go."""
        if self.stage(state) in self.stages[:2]:
            cube = state.pose("cube")
            return Aim("cube", cube.position, grasp_rotation(state.tool.rotation, cube.rotation))
        above = state.object("bin").top + _ABOVE * state.scale
        return Aim("bin", np.array([*state.pose("bin").position[:2], above]))

    def outcome(self, state: TaskState) -> Verdict:
        """Judge where the cube is, whether it rests, and where the gripper is."""
        position = state.pose("cube").position
        if position[2] < 2 * state.object("cube").shape.size[0]:
            return Verdict(failure="dropped")
        local, half = _in_bin(state, position)
        rests = bool(np.all(np.abs(local) < half)) and "cube" in state.still
        return Verdict(success=rests and state.let_go(position))


def grasp_rotation(tool: FloatArray, cube: FloatArray, turns: int = 4) -> FloatArray:
    """Return the rotation nearest to the tool's that points it down, fingers square to the cube, (3, 3).

    Args:
        tool: world from tool, (3, 3).
        cube: world from cube, (3, 3).
        turns: 2 where the fingers close along its x alone.
    """
    angles = np.arctan2(cube[1, 0], cube[0, 0]) + 2 * np.pi / turns * np.arange(turns)
    ahead = ([np.cos(angle), np.sin(angle), 0.0] for angle in angles)
    return nearest_rotation(tool, (hand_rotation(x, [0.0, 0.0, -1.0]) for x in ahead))


def _sample_table(name: str, side: float, world: WorldScale, rng: np.random.Generator) -> SceneObject:
    scale = world.scale
    x, y = 1.05 + rng.uniform(-0.05, 0.05), side * 1.35 + rng.uniform(-0.05, 0.05)
    return table(name, scale * x, scale * y, (scale * 0.6, scale * 0.7, rng.uniform(*world.tables)), scale)


def _sample_cube(on: SceneObject, world: WorldScale, rng: np.random.Generator, length: float) -> SceneObject:
    x = on.front + world.scale * rng.uniform(0.10, 0.20)
    y = on.position[1] + world.scale * rng.uniform(-0.15, 0.15)
    yaw = rng.uniform(-np.pi / 4, np.pi / 4)  # a cube looks the same every quarter turn
    edge = _SLIM * world.cube if length else world.cube
    return cube(x, y, on.top, yaw, edge, _MASS * world.grip**3, length)


def _sample_bin(on: SceneObject, world: WorldScale, rng: np.random.Generator, length: float) -> SceneObject:
    scale = world.scale
    inner = scale * rng.uniform(0.24, 0.28) + length / 2
    x = on.front + inner / 2 + scale * rng.uniform(0.04, 0.10)
    y = on.position[1] + scale * rng.uniform(-0.12, 0.12)
    return open_bin(x, y, on.top, inner, scale * _BIN_HEIGHT, scale)


def _in_bin(state: TaskState, position: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a place in the bin's frame, and half the bin's lengths, (3,) each [m]."""
    pose = state.pose("bin")
    return pose.rotation.T @ (position - pose.position), state.object("bin").shape.size / 2
