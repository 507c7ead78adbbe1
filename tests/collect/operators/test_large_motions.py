"""Large motions of the hand: without folding the arm, without leaning, without hitting the cabinet."""

import numpy as np
import pytest
from collect_helpers import episode
from device_helpers import HOME, MODEL, PERFECT, drive, first_view

from handrail.collect.operators.operator import View
from handrail.collect.operators.scripted.placement import REACHED, arm_solutions, straight_solution
from handrail.collect.operators.scripted.steering import Gains, MotionGoal, Target, hand_twist, pose_errors
from handrail.collect.seeds import episode_seed
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.robot.inverse_kinematics import arm_configuration
from handrail.controllers.robot.model import Pose

DOWN = np.diag([1.0, -1.0, -1.0])


class Bring:
    """Wants the hand at one pose and rests there; a script."""

    def __init__(self, goal, tilt=np.inf):
        self._goal, self._tilt = goal, tilt

    def reset(self, view):
        pass

    def motion_goal(self, view):
        distance, angle = pose_errors(view.tool, self._goal)
        if distance < 0.02 and angle < 0.1:
            return MotionGoal.rest()
        target = Target(self._goal, view.state.q[:3], distance=0.02, angle=0.2, tilt=self._tilt)
        return MotionGoal(hand_twist(view.tool, self._goal, Gains()), np.zeros(3), target=target)


@pytest.fixture(scope="module")
def view() -> View:
    return first_view()


def nearest(path):
    """Return the smallest distance of the robot to itself along a path [m]."""
    return float(np.min(CollisionModel(MODEL).values(path[::2])))


def by_joints(*offsets: float) -> Pose:
    """Return where the tool is when the arm's joints are off from home by so much [rad]."""
    return MODEL.pose(HOME + np.array([0.0, 0.0, 0.0, *offsets]))


def leans(path):
    """Return how far the hand leans from pointing down along a path [rad]."""
    return np.array([np.arccos(np.clip(-MODEL.pose(q).rotation[2, 2], -1.0, 1.0)) for q in path])


@pytest.mark.parametrize(
    "offsets",
    [
        (0.0, 0.8, -1.6, -0.8, 0.0, -2.4),
        (0.2, 0.3, -0.4, -1.2, 0.0, -2.6),
        (0.2, 0.7, -1.2, -1.0, -0.2, -2.7),
    ],
)
def test_a_leader_makes_large_turns_without_folding_the_arm(view, offsets):
    """By the hand's straight way, the forearm would come within 36 mm of the palm."""
    goal = by_joints(*offsets)
    _, path = drive(view, "leader", PERFECT, 16.0, Bring(goal))
    end = MODEL.pose(path[-1])
    assert np.linalg.norm(end.position - goal.position) < 0.02
    assert np.trace(end.rotation.T @ goal.rotation) > 2.98
    assert nearest(path) > 0.07


def test_the_nearest_solution_is_taken_that_keeps_clear():
    """The first of all in the order of how far the joints turn; the one that keeps clearest if none does."""
    collision, share = CollisionModel(MODEL), np.linspace(0.1, 1.0, 10)[:, None]
    farther = 0
    for offsets in np.random.default_rng(3).uniform(-2.0, 2.0, (6, 6)):
        goal = by_joints(*offsets)
        ways = [there - HOME for there, error in arm_solutions(MODEL, HOME, goal) if error < REACHED]
        far = [np.linalg.norm(way) for way in ways]
        assert far == sorted(far)
        assert np.max(np.abs(ways)) <= np.pi + 1e-9  # the shorter way around
        kept = np.array([np.min(collision.values(HOME + share * way)) for way in ways])
        for clear in (0.03, np.median(kept), np.inf):
            there = straight_solution(MODEL, collision, HOME, goal, clear)
            which = np.argmax(kept >= clear) if np.any(kept >= clear) else np.argmax(kept)
            np.testing.assert_allclose(there, HOME + ways[which], atol=1e-12)
            np.testing.assert_allclose(MODEL.pose(there).position, goal.position, atol=0.01)
            farther += which > 0
    assert farther


def test_one_axis_at_a_time_keeps_the_hand_upright_where_it_must_not_lean(view):
    ahead = HOME[:3] * [1.0, 1.0, 0.0] + [1.1, 0.0, 0.95]
    down = arm_configuration(MODEL, HOME, Pose(ahead, DOWN))[0]
    goal = Pose(MODEL.pose(down).position + [0.05, 0.1, -0.15], DOWN)
    worst = {}
    for tilt in (0.06, np.inf):
        script = Bring(goal, tilt)
        _, path = drive(view, "direct_single", PERFECT, 40.0, script, start=down)
        assert np.linalg.norm(MODEL.pose(path[-1]).position - goal.position) < 0.03
        worst[tilt] = leans(path).max()
    assert worst[0.06] < 0.08
    assert worst[np.inf] > 0.12


@pytest.mark.parametrize("person", [1, 3])
def test_an_expert_by_joints_turns_the_hand_over_without_touching_himself(person):
    """By the hand's way, the palm was pressed against the forearm for 20 s."""
    outcome = episode(episode_seed(900, person), task="reach", mode="direct", person=person)
    assert outcome.success
    assert outcome.contact_onsets == 0
