"""Reach a pose with the tool: the benchmark of the paper's Table I."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from handrail.collect.world.observation import padded, pose_names, pose_numbers, row_names
from handrail.collect.world.scene import Part, Patrol, Scene, SceneObject, Viewpoint, box
from handrail.collect.world.task import Aim, Start, Task, TaskState, Verdict
from handrail.collect.world.tasks.furniture import footprint
from handrail.collect.world.tasks.goal_reaching import (
    ANGLE_TOLERANCE,
    POSITION_TOLERANCE,
    pose_error,
    reached,
    sample_goal,
)
from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.numerics.rotation import matrix_from_rpy
from handrail.controllers.robot.inverse_kinematics import body_configuration
from handrail.controllers.robot.model import Pose, RobotModel
from handrail.controllers.robot.shape import Shape

_COLOURS = (  # of the marker's faces: +x, −x, +y, −y, +z, −z
    (0.90, 0.10, 0.10, 1.0),
    (0.45, 0.75, 1.00, 1.0),
    (0.10, 0.70, 0.15, 1.0),
    (1.00, 0.45, 0.85, 1.0),
    (0.10, 0.15, 0.90, 1.0),
    (1.00, 0.85, 0.10, 1.0),
)
_EDGE = 0.18  # of the marker [m]
_MOST_TRIES = 200
_POSTURES = 30
_REACHED = 1e-3  # error of the hand's pose that is left [m, rad]
_CLEAR = 0.12  # kept to itself and to the floor there, at scale 1 [m]
VIEW = Viewpoint(position=(-2.6, -3.0, 2.2), target=(-0.35, 0.0, 0.65))

FASTEST = 0.5  # [m/s]
_SLOWEST = 0.2  # [m/s]
_APART = 1.2  # of a lane's start from the robot's base [m]
_QUANTITIES = ("x", "y", "vx", "vy", "radius", "height")
_COLOUR = (0.80, 0.20, 0.45, 1.0)


def sample_movers(
    count: int, model: RobotModel, q: FloatArray, rng: np.random.Generator
) -> list[SceneObject]:
    """Draw cylinders that pass through the workspace's middle, in any direction, at up to 0.5 m/s · scale.

    Args:
        count: how many.
        model: of the robot.
        q: where the robot starts, (n,); no mover starts near its base.
        rng: drawn from.
    """
    base, scale = model.pose(q, "planar_base").position[:2], model.description.world.scale
    movers: list[SceneObject] = []
    while len(movers) < count:
        item = _sample_mover(f"mover_{len(movers)}", scale, rng)
        if np.linalg.norm(item.position[:2] - base) > _APART * scale + footprint(item):
            movers.append(item)
    return movers


def _sample_mover(name: str, scale: float, rng: np.random.Generator) -> SceneObject:
    """Return a mover from 1.5 to 2 m · scale before a point of the workspace to 3 m · scale behind it."""
    radius, height = scale * rng.uniform(0.1, 0.2), scale * rng.uniform(0.3, 1.5)
    angle = rng.uniform(-np.pi, np.pi)
    ahead = np.array([np.cos(angle), np.sin(angle), 0.0])
    middle = np.array([*(scale * rng.uniform([-1.2, -0.8], [0.6, 0.8])), height / 2])
    start, end = middle - scale * rng.uniform(1.5, 2.0) * ahead, middle + 3.0 * scale * ahead
    patrol = Patrol(start, end, scale * rng.uniform(_SLOWEST, FASTEST))
    shape = Shape("cylinder", np.array([radius, height]))
    return SceneObject(name, shape, start, rgba=_COLOUR, patrol=patrol)


def sample_goal_for(model: RobotModel, rng: np.random.Generator) -> Pose:
    """Draw a goal in a robot's world.

    An arm of six joints or more gets the paper's goals, made to the measure of the robot's world; a shorter
    one gets the hand's heading, pitch and roll. A goal that no place of the base puts in reach is not taken.
    """
    description = model.description
    world, joints = description.world, np.count_nonzero(model.moving) - len(description.base.joints)
    lower, upper = (-world.scale, -world.scale, world.goals[0]), (world.scale, world.scale, world.goals[1])
    for _ in range(_MOST_TRIES):
        if joints >= 6:
            goal = sample_goal(rng, lower, upper)
            if any(body_configuration(model, q, goal)[1] < _REACHED for q in _postures(model)):
                return goal
        else:
            goal = Pose(rng.uniform(lower, upper), _rotation(world.pitch, world.roll, rng))
            if _is_clear(model, *body_configuration(model, description.home, goal)):
                return goal
    raise HandrailError(
        f"task Reach: expected a robot that reaches its goals, got {description.name}, "
        f"which reached none of {_MOST_TRIES}"
    )


@lru_cache(maxsize=8)
def _postures(model: RobotModel) -> tuple[FloatArray, ...]:
    """Return postures from which a hand is brought to a goal: home, then random ones of the same base."""
    limits, home = model.description.limits, model.description.home
    lower, upper = np.clip([limits.position_lower, limits.position_upper], -np.pi, np.pi)
    others = np.random.default_rng(0).uniform(lower, upper, (_POSTURES, model.size))
    base = len(model.description.base.joints)
    others[:, :base] = home[:base]
    return (home, *others)


def _is_clear(model: RobotModel, q: FloatArray, error: float) -> bool:
    """Return whether the hand is where it shall be but for the error, clear of the robot and of the floor."""
    clear = _CLEAR * model.description.world.scale
    return error < _REACHED and float(np.min(CollisionModel(model).values(q[None]))) >= clear


def _rotation(pitch: tuple[float, float], roll: tuple[float, float], rng: np.random.Generator) -> FloatArray:
    """Return a hand with any heading; pitch 0 points ahead, π/2 down; x of roll 0 points down, then back."""
    yaw = rng.uniform(-np.pi, np.pi)
    level = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    ahead = matrix_from_rpy([0.0, rng.uniform(*pitch), yaw]) @ level
    return ahead @ matrix_from_rpy([0.0, 0.0, rng.uniform(*roll)])


@dataclass(frozen=True)
class Reach(Task):
    """Goals uniform in x, y ∈ [−1, 1] m, z ∈ [0.7, 1.0] m, with a random orientation; start at home.

    Success at the first moment with `d_p ≤ 0.1 m` and `d_r = 1 − ⟨q, g⟩² ≤ 0.05`. Lengths are made to the
    measure of the robot's world; goals of an arm that cannot point everywhere are those that it gets to.
    """

    description: str = "Move the gripper to the goal frame."
    time_limit: float = 30.0  # [s]
    moving_obstacles: int = 0
    """How many cylinders cross the robot's way; goals are the same with and without."""
    stages = ("approach", "turn")

    @property
    def state_names(self) -> tuple[str, ...]:
        """The goal's position and quaternion, and what moves."""
        return (*pose_names("goal"), *row_names("mover", self.moving_obstacles, _QUANTITIES))

    def sample(self, model: RobotModel, rng: np.random.Generator) -> Start:
        """Draw a goal, then the moving obstacles."""
        goal, scale = sample_goal_for(model, rng), model.description.world.scale
        movers = sample_movers(self.moving_obstacles, model, model.description.home, rng)
        scene = Scene((goal_marker(goal, scale), *movers), VIEW.scaled(scale))
        return Start(scene, model.description.home, goal)

    def features(self, state: TaskState) -> FloatArray:
        """Return the goal pose, (7,), and place [m], velocity [m/s] and size [m] of what moves, (6,) each.

        Zero for the movers that a scene of one's own does not have.
        """
        rows = (
            (*now.position[:2], *now.velocity[:2], footprint(item), item.top)
            for item in state.start.scene.movers
            for now in (item.obstacle(state.time),)
        )
        return np.append(pose_numbers(_goal(state)), padded(rows, self.moving_obstacles, len(_QUANTITIES)))

    def aim(self, state: TaskState) -> Aim:
        """Return the goal."""
        goal = _goal(state)
        return Aim("goal", goal.position, goal.rotation, POSITION_TOLERANCE * state.scale, ANGLE_TOLERANCE)

    def stage(self, state: TaskState) -> str:
        """Return what is to be done: get to the goal, or turn there."""
        return "turn" if _errors(state)[0] <= POSITION_TOLERANCE else "approach"

    def outcome(self, state: TaskState) -> Verdict:
        """Judge by the distance and the orientation error."""
        return Verdict(reached(*_errors(state)))


def _goal(state: TaskState) -> Pose:
    return state.goal if state.goal is not None else state.tool


def _errors(state: TaskState) -> tuple[float, float]:
    """Return d_p as in a world of scale 1 [m], and d_r."""
    d_p, d_r = pose_error(state.tool.position, state.tool.rotation, _goal(state))
    return d_p / state.scale, d_r


def goal_marker(goal: Pose, scale: float = 1.0) -> SceneObject:
    """Return a cube whose faces have six colours, drawn without contact: place and turn can be seen."""
    edge, sides = scale * _EDGE, [(axis, side) for axis in np.eye(3) for side in (1.0, -1.0)]
    faces = (
        Part(box(edge - 0.96 * edge * axis), 0.48 * side * edge * axis, rgba=colour)
        for (axis, side), colour in zip(sides, _COLOURS, strict=True)
    )
    cube = box([edge] * 3)
    return SceneObject("goal", cube, goal.position, goal.rotation, ghost=True, parts=tuple(faces))
