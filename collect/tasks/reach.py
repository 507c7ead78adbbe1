"""Reach a pose with the tool: the benchmark of the paper's Table I."""

from dataclasses import dataclass

import numpy as np

from handrail.collect.simulation.scene import Part, Scene, SceneObject, Viewpoint
from handrail.collect.tasks.goal_reaching import ANGLE_TOLERANCE, POSITION_TOLERANCE, pose_error, reached
from handrail.collect.tasks.goals import sample_goal_for
from handrail.collect.tasks.moving import mover_features, mover_names, sample_movers
from handrail.collect.tasks.task import Aim, Start, TaskState, Verdict
from handrail.controllers.arrays import FloatArray
from handrail.controllers.numerics.rotation import matrix_to_axis, quaternion_from_matrix
from handrail.controllers.robot.model import Pose, RobotModel
from handrail.controllers.robot.shape import Shape

_COLOURS = ((0.85, 0.15, 0.15, 1.0), (0.15, 0.7, 0.2, 1.0), (0.15, 0.3, 0.9, 1.0))
_ARROW = 0.18  # length of the marker's axes [m]
_STAGES = ("approach", "turn")


@dataclass(frozen=True)
class Reach:
    """Goals uniform in x, y ∈ [−1, 1] m, z ∈ [0.7, 1.0] m, with a random orientation; start at home.

    Success at the first moment with `d_p ≤ 0.1 m` and `d_r = 1 − ⟨q, g⟩² ≤ 0.05`. Lengths are made to the
    measure of the robot's world; goals of an arm that cannot point everywhere are those that it gets to.

    Attributes:
        description: what the operator is asked to do.
        horizon: time limit [s].
        moving_obstacles: how many cylinders cross the robot's way; goals are the same with and without.
    """

    description: str = "Move the gripper to the goal frame."
    horizon: float = 30.0
    moving_obstacles: int = 0

    @property
    def state_names(self) -> tuple[str, ...]:
        """The goal's position and quaternion, and what moves."""
        goal = tuple(f"goal.{axis}" for axis in ("x", "y", "z", "qw", "qx", "qy", "qz"))
        return (*goal, *mover_names(self.moving_obstacles))

    def sample(self, model: RobotModel, rng: np.random.Generator) -> Start:
        """Draw a goal, then the moving obstacles."""
        goal, scale = sample_goal_for(model, rng), model.description.world.scale
        movers = sample_movers(self.moving_obstacles, model, model.description.home, rng)
        scene = Scene((goal_marker(goal, scale), *movers), _VIEW.scaled(scale))
        return Start(scene, model.description.home, goal)

    def features(self, state: TaskState) -> FloatArray:
        """Return the goal pose, (7,), and place, velocity and size of what moves, (6,) each."""
        goal = _goal(state)
        movers = mover_features(state.start.scene, state.time, self.moving_obstacles)
        return np.concatenate([goal.position, quaternion_from_matrix(goal.rotation), movers])

    def aim(self, state: TaskState) -> Aim:
        """Return the goal."""
        goal = _goal(state)
        return Aim("goal", goal.position, goal.rotation, POSITION_TOLERANCE * state.scale, ANGLE_TOLERANCE)

    @property
    def stages(self) -> tuple[str, ...]:
        """What is done one after the other."""
        return _STAGES

    def stage(self, state: TaskState) -> str:
        """Return what is to be done: get to the goal, or turn there."""
        d_p, _ = pose_error(state.tool.position, state.tool.rotation, _goal(state))
        return "turn" if d_p / state.scale <= POSITION_TOLERANCE else "approach"

    def outcome(self, state: TaskState) -> Verdict:
        """Judge by the distance and the orientation error."""
        d_p, d_r = pose_error(state.tool.position, state.tool.rotation, _goal(state))
        return Verdict(reached(d_p / state.scale, d_r))


_VIEW = Viewpoint(position=(-2.6, -3.0, 2.2), target=(-0.35, 0.0, 0.65))


def _goal(state: TaskState) -> Pose:
    return state.goal if state.goal is not None else state.tool


def goal_marker(goal: Pose, scale: float = 1.0) -> SceneObject:
    """Return three coloured axes on a ball, drawn without contact."""
    axes = tuple(
        Part(
            Shape("capsule", scale * np.array([0.011, _ARROW])),
            scale * np.eye(3)[index] * _ARROW / 2,
            matrix_to_axis(np.eye(3)[index]),
            colour,
        )
        for index, colour in enumerate(_COLOURS)
    )
    ball = Part(Shape("sphere", scale * np.array([0.03])), np.zeros(3), rgba=(0.95, 0.85, 0.2, 1.0))
    return SceneObject(
        "goal",
        Shape("sphere", scale * np.array([_ARROW])),
        goal.position,
        goal.rotation,
        ghost=True,
        parts=(*axes, ball),
    )
