"""What lasts from update to update: one value in the MPC, and nobody but the robot knows what it was sent."""

from dataclasses import replace

import numpy as np
import pytest
from ideal_robot import HOME, LIMITS, MODEL, PERIOD, Robot, asking, clutter

from handrail.controllers.baselines.cbf_filter import CbfFilter
from handrail.controllers.baselines.direct import DirectController
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.prediction import Extrapolated, Smoothed
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.robot.shape import Obstacle, Shape

CHANNELS = Channels.of(MODEL.description)
MPC = MaskedMpc(MODEL, predict=Smoothed(Extrapolated(), 0.3))
HAND = asking(np.full(18, 0.2), "ee")
BASE = asking(np.full(18, -0.4), "base")
HELD = Obstacle("box", Shape("box", [0.06, 0.06, 0.06]), [0.0, 0.0, 0.06], frame="tool")


def same(one, other):
    """Whether two commands are the same, but for how long they took."""
    timeless = [replace(c.diagnostics, solve_time=0.0) for c in (one, other)]
    return np.array_equal(one.velocities, other.velocities) and timeless[0] == timeless[1]


def test_asking_for_a_problem_changes_nothing():
    """Not the prediction's memory, nor parameters, nor the margins of what has just been grasped."""
    scene, runs = (*clutter(np.random.default_rng(4)), HELD), []
    for asks in (False, True):
        robot, commands = Robot(MPC, scene), []
        for _ in range(12):
            if asks:
                robot.observe()
                loop = MPC.loop
                for other in (BASE, HAND):
                    MPC.build_problem(robot.state, other(robot.time + 0.01))
                assert MPC.loop is loop
            commands.append(robot.update(HAND(robot.time)))
        runs.append(commands)
    assert all(same(*commands) for commands in zip(*runs, strict=True))


def test_an_update_depends_on_the_loop_state_alone():
    """Put back after others have passed, the same state and intent get the same command, bit for bit."""
    robot = Robot(MPC, (*clutter(np.random.default_rng(4)), HELD))
    for _ in range(8):
        robot.update(HAND(robot.time))
    loop, state, time = MPC.loop, robot.state, robot.time
    first = MPC.update(state, HAND(time))
    for _ in range(8):
        robot.time += PERIOD
        robot.update(BASE(robot.time))
    MPC.loop = loop
    assert same(MPC.update(state, HAND(time)), first)


@pytest.mark.parametrize("build", [DirectController, CbfFilter])
def test_a_controller_s_earlier_intents_do_not_matter(build):
    """It looks at one moment: an old one and a new one answer a state alike."""
    ask = asking(np.full(18, 0.3), "joint")
    robot = Robot(build(MODEL))
    for _ in range(8):
        robot.update(ask(robot.time))
    state = State(HOME, 0.1 * LIMITS.velocity, robot.time, 0.2 * LIMITS.velocity)
    assert same(robot.controller.update(state, ask(robot.time)), build(MODEL).update(state, ask(robot.time)))
