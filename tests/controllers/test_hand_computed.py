"""Numbers that a person can work out: how near the tool is to a work surface, how fast it is asked to go."""

from dataclasses import replace

import numpy as np
import pytest

from handrail.controllers import MaskedMpc
from handrail.controllers.baselines.catalogue import CONTROLLERS
from handrail.controllers.baselines.twist_completion import TwistController, WholeBodyCompletion
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.registry import resolved
from handrail.controllers.robot.model import load_model
from handrail.controllers.robot.shape import Obstacle, Shape

MODEL = load_model()
CHANNELS = Channels.of(MODEL.description)
HOME = np.array(MODEL.description.home)
STILL = State(HOME, np.zeros(MODEL.size), 0.0, np.zeros(MODEL.size))
GAP, NEARER = 0.31, 0.12  # [m]


def lowest_of_the_tool() -> float:
    """Return the height of the lowest corner of the tool's boxes at home [m]."""
    heights = []
    for placed in MODEL.description.collision:
        if not placed.tool:
            continue
        assert placed.shape.kind == "box"
        pose = MODEL.pose(HOME, placed.frame)
        corners = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1).T * placed.shape.size
        on_frame = corners @ placed.placement.rotation.T + placed.placement.translation
        heights.append((pose.position + on_frame @ pose.rotation.T)[:, 2].min())
    return float(min(heights))


def table() -> Obstacle:
    """Return a work surface below the hand, as wide as the hand is, and not in reach of the base."""
    top, hand = lowest_of_the_tool() - GAP, MODEL.pose(HOME).position
    centre = np.array([hand[0] + 0.1, hand[1], top - 0.01])
    return Obstacle("table", Shape("box", np.array([0.5, 0.6, 0.02])), centre, work_surface=True)


def wall() -> Obstacle:
    """Return a wall beside the chassis, lower than the arm."""
    width = MODEL.description.base.size[1]
    centre = np.array([HOME[0], HOME[1] + width / 2 + NEARER + 0.05, 0.1])
    return Obstacle("wall", Shape("box", np.array([0.3, 0.1, 0.2])), centre)


BUILT = {
    "mpc": lambda: MaskedMpc(MODEL),
    "filter": lambda: resolved(CONTROLLERS["filter"].build)(MODEL, 0.05),
    "cbf": lambda: resolved(CONTROLLERS["cbf"].build)(MODEL, 0.05),
    "dls": lambda: TwistController(MODEL, WholeBodyCompletion(MODEL), 0.05),
}


@pytest.mark.parametrize("name", BUILT)
def test_work_distance_is_the_tools_to_the_table_and_smallest_distance_is_not(name):
    controller = BUILT[name]()
    idle = Intent.idle(CHANNELS)
    for obstacles, work in (((table(), wall()), GAP), ((replace(table(), work_surface=False),), np.inf)):
        controller.reset(obstacles)
        said = controller.update(STILL, idle).diagnostics
        assert said.work_distance == pytest.approx(work, abs=1e-6)
    controller.reset((table(), wall()))
    assert controller.update(STILL, idle).diagnostics.smallest_distance <= NEARER + 1e-6


@pytest.mark.parametrize("axis", range(3))
def test_nobody_asks_the_tool_to_go_faster_than_the_largest_speed(axis):
    """Beyond it, faster is the same; below it, it is not."""

    def plan(speed: float, largest: float) -> np.ndarray:
        mpc = MaskedMpc(MODEL, MpcSettings(largest_speed=largest))
        values = np.zeros(CHANNELS.size)
        values[CHANNELS.hand_slice().start + axis] = speed
        command = mpc.update(STILL, Intent(values, CHANNELS.mask("ee")))
        return np.array([command.velocity(time) for time in (0.05, 0.2, 0.5)])

    np.testing.assert_array_equal(plan(50.0, 0.2), plan(0.2, 0.2))
    np.testing.assert_array_equal(plan(-50.0, 0.2), plan(-0.2, 0.2))
    np.testing.assert_array_equal(plan(0.2, 0.2), plan(0.2, 2.0))
    assert np.abs(plan(0.1, 0.2) - plan(0.2, 0.2)).max() > 1e-3
    assert np.abs(plan(0.3, 0.2) - plan(0.3, 2.0)).max() > 1e-3
