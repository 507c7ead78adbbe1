"""Where a rollout failed: the furthest stage it came to, and how it ended."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from handrail.collect.world.task import TaskState
from handrail.collect.world.tasks.pick_place import PickPlace
from handrail.collect.world.tasks.reach import Reach
from handrail.collect.world.tasks.tray import Tray
from handrail.controllers.robot.model import Pose, load_model
from handrail.policies.imitation.evaluation.rollout import RolloutProgress

MODEL = load_model()
START = PickPlace().sample(MODEL, np.random.default_rng(0))
CUBE, BIN = START.scene.find("cube"), START.scene.find("bin")
WIDTH = float(CUBE.shape.size[0])
UP = np.array([0.0, 0.0, 1.0])


def state(tool, cube=CUBE.position, opening=1.0):
    """A moment of `pick_place` with tool and cube anywhere."""
    poses = {each.name: Pose(each.position, each.rotation) for each in START.scene.objects}
    poses["cube"] = Pose(np.asarray(cube, float), CUBE.rotation)
    return TaskState(0.0, (Pose(np.asarray(tool, float), np.eye(3)),), (opening,), START, poses)


AWAY = state(CUBE.position + 0.5 * UP)
AT = state(CUBE.position + 1.5 * WIDTH * UP)
AROUND = state(CUBE.position, opening=0.5)
LIFTED = state(CUBE.position + 2 * WIDTH * UP, CUBE.position + 2 * WIDTH * UP, 0.5)
OVER = state(BIN.position + 0.4 * UP, BIN.position + 0.4 * UP, 0.5)
IN_ORDER = {"approach": AWAY, "grasp": AT, "lift": AROUND, "carry": LIFTED, "place": OVER}


def test_every_stage_has_its_moment_in_order():
    task = PickPlace()
    assert tuple(IN_ORDER) == task.stages
    assert [task.stage(moment) for moment in IN_ORDER.values()] == list(task.stages)


class Aimless(Tray):
    """A task that neither has stages nor says where the hand is to go."""

    def aim(self, state):
        """Return nothing."""


def watched(states, task=None, reason="timeout", contacts=()):
    """Return what is said of a failed rollout that went through some moments, some of them with a contact."""
    moments = iter(states)
    env = SimpleNamespace(task=task or PickPlace(), fps=20, model=MODEL, task_state=lambda: next(moments))
    progress = RolloutProgress()
    progress.begin(env, 0)  # type: ignore[arg-type]
    for moment in range(len(states)):
        progress.see(SimpleNamespace(contacts=moment in contacts))  # type: ignore[arg-type]
    if contacts:
        return progress.told
    return progress.failed(SimpleNamespace(failure_reason=reason))  # type: ignore[arg-type]


@pytest.mark.parametrize("last", list(IN_ORDER))
def test_the_furthest_stage_is_told_and_a_hand_that_rests_has_stalled(last):
    names = list(IN_ORDER)
    way = [IN_ORDER[name] for name in names[: names.index(last) + 1]]
    assert watched([*way, *[way[-1]] * 200]) == {"stage": last, "ended": "stalled"}


def test_a_hand_that_still_goes_about_has_not_stalled():
    about = [state(CUBE.position + (0.5 + 0.1 * (k % 2)) * UP) for k in range(200)]
    assert watched(about) == {"stage": "approach", "ended": "moving"}


def test_a_lifted_object_that_is_lost_was_dropped():
    lost = state(CUBE.position + 0.5 * UP)
    assert watched([AROUND, LIFTED, *[lost] * 200]) == {"stage": "carry", "ended": "dropped"}
    assert watched([AWAY, AT], reason="dropped") == {"stage": "grasp", "ended": "dropped"}


def test_a_hand_that_was_at_the_goal_had_only_to_turn():
    task = Reach()
    start = task.sample(MODEL, np.random.default_rng(0))

    def at(away, turned):
        tool = Pose(start.goal.position + away * UP, start.goal.rotation @ pin.exp3(turned * UP))
        return TaskState(0.0, (tool,), (1.0,), start, {})

    far, near, there = at(0.11, 0.0), at(0.09, 1.0), at(0.09, 0.4)
    assert [task.stage(moment) for moment in (far, near)] == list(task.stages)
    assert [task.outcome(moment).success for moment in (far, near, there)] == [False, False, True]
    assert watched([far] * 200, task) == {"stage": "approach", "ended": "stalled"}
    assert watched([near, *[far] * 200], task) == {"stage": "turn", "ended": "stalled"}


def test_a_task_without_stages_says_how_it_ended():
    assert watched([AWAY] * 200, Aimless()) == {"ended": "stalled"}


def test_the_distance_is_told_each_second_and_the_first_contact():
    """To the cube, then, once it is in hand, to the place above the bin: each as the task's aim says it."""
    way = [*[AWAY] * 20, *[AT] * 20, *[OVER] * 5]
    above = PickPlace().aim(OVER)
    expected = [0.5, 1.5 * WIDTH, np.linalg.norm(OVER.tool.position - above.position)]
    told: Any = watched(way, contacts=(30, 31, 40))
    np.testing.assert_allclose(told["distances"], expected, atol=5e-4)
    assert told["first_contact"] == 1.5
    assert watched([AWAY] * 200, Aimless(), contacts=(7,)) == {"distances": [], "first_contact": 0.35}


def test_of_two_hands_the_nearest_counts_or_their_middle_and_both_have_to_stand():
    def both(left, right):
        tools = tuple(Pose(CUBE.position + way, np.eye(3)) for way in (left, right))
        return replace(AWAY, tools=tools, openings=(1.0, 1.0))

    aside = np.array([0.0, 0.3, 0.0])
    told: Any = watched([both(UP, 0.2 * UP)] * 20 + [both(0.9 * aside, -aside)] * 20, contacts=(1,))
    np.testing.assert_allclose(told["distances"], [0.2, 0.015], atol=5e-4)
    moves = [both(UP, UP + 0.1 * (k % 2) * aside) for k in range(200)]
    assert watched(moves)["ended"] == "stalled"
    assert watched([both(UP, UP + (k % 2) * aside) for k in range(200)])["ended"] == "moving"
