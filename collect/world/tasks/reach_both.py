"""Reach a pose with each of two hands at once."""

from dataclasses import dataclass, replace

import numpy as np

from handrail.collect.world.observation import pose_names, pose_numbers
from handrail.collect.world.scene import Scene
from handrail.collect.world.task import Start, TaskState, Verdict
from handrail.collect.world.tasks.catalogue import check_robot
from handrail.collect.world.tasks.reach import VIEW, Reach, goal_marker
from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import Pose, RobotModel

_MOST_TRIES = 20_000
_BENT = 1.0  # each joint from home, at most [m, rad]
_CLEAR = 0.06  # kept to itself there, at scale 1 [m]
OTHER = "other_goal"  # of the hand that does not begin


@dataclass(frozen=True)
class ReachBoth(Reach):
    """Goals are where both hands are in a random posture; `Reach` says how near is enough; start at home.

    The posture keeps clear of itself. Its base is in x, y ∈ [−1, 1] m · scale, its joints are at most 1 m or
    1 rad from home, its hands as high as goals of `Reach`. Success: both hands are at their goals at once.
    """

    description: str = "Move each gripper to its own goal frame."
    time_limit: float = 60.0  # [s]

    @property
    def state_names(self) -> tuple[str, ...]:
        """Positions and quaternions of the goals: of the hand that begins, then of the other."""
        return (*super().state_names, *pose_names(OTHER))

    def sample(self, model: RobotModel, rng: np.random.Generator) -> Start:
        """Draw the posture."""
        check_robot("reach_both", model.description)
        goals, scale = _sample_goals(model, rng), model.description.world.scale
        goal, other = goals[model.number], goals[1 - model.number]
        markers = goal_marker(goal, scale), replace(goal_marker(other, scale), name=OTHER)
        return Start(Scene(markers, VIEW.scaled(scale)), model.description.home, goal)

    def features(self, state: TaskState) -> FloatArray:
        """Return both goals' poses, (14,)."""
        return np.append(super().features(state), pose_numbers(state.pose(OTHER)))

    def outcome(self, state: TaskState) -> Verdict:
        """Judge both hands."""
        one, other = (Reach.outcome(self, each) for each in (state, _of_other(state)))
        return Verdict(one.success and other.success)


def _of_other(state: TaskState) -> TaskState:
    """Return the moment as it is for the other hand, which has a goal of its own."""
    return replace(state, hand=1 - state.hand, start=replace(state.start, goal=state.pose(OTHER)))


def _sample_goals(model: RobotModel, rng: np.random.Generator) -> list[Pose]:
    """Return where the hands are in a random posture, in the description's order."""
    description, collision = model.description, CollisionModel(model)
    limits, world, base = description.limits, description.world, len(description.base.joints)
    clear = np.minimum(collision.largest_margin, _CLEAR * world.scale)
    place = np.array([world.scale, world.scale, np.pi])[:base]
    for _ in range(_MOST_TRIES):
        q = description.home + rng.uniform(-_BENT, _BENT, model.size)
        q[:base] = rng.uniform(-place, place)
        q = np.clip(q, limits.position_lower, limits.position_upper)
        goals = [model.pose(q, hand.named("tool")) for hand in description.hands]
        level = all(world.goals[0] <= goal.position[2] <= world.goals[1] for goal in goals)
        if level and bool(np.all(collision.values(q[None])[0] >= clear)):
            return goals
    raise HandrailError(
        f"task ReachBoth: expected a robot with both hands {world.goals[0]} to {world.goals[1]} m high, "
        f"clear of itself, got {description.name}, which did in none of {_MOST_TRIES} postures"
    )
