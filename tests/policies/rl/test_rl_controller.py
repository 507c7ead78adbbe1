"""The baseline as a controller: what it does is what its environment does, and bad input brakes it."""

from dataclasses import replace

import numpy as np
import pytest
from rl_helpers import random_actor

from handrail.collect.world.ideal_robot import IdealRobot
from handrail.collect.world.plant import Gate
from handrail.collect.world.scene import Scene
from handrail.collect.world.tasks.goal_reaching import STEP
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Status
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.model import Pose, load_model
from handrail.policies.rl.controller import RlController
from handrail.scripts.bench.rl.env import GoalReachingEnv

MODEL = load_model()
CHANNELS = Channels.of(MODEL.description)


def intent(twist, time: float = 0.0) -> Intent:
    values = np.zeros(CHANNELS.size)
    values[CHANNELS.tool_slice] = twist
    return Intent(values, CHANNELS.mask("ee"), time=time)


@pytest.fixture
def controller():
    return RlController(MODEL, actor=random_actor())


def test_the_controller_moves_like_the_environment(controller):
    """Law: fed with the planner's twists, it commands the velocities that the actor was trained with."""
    env, actor = GoalReachingEnv(early_failure=False, physics=False), random_actor()
    home = MODEL.description.home
    for seed in (0, 1):
        observation, _ = env.reset(seed=seed)
        controller.reset()
        controller.aim(env.planner.goal)
        robot = IdealRobot(MODEL, Scene(), home, STEP, gate=Gate(MODEL, STEP, precision=np.float64))
        for t in range(80):
            command = controller.update(robot.state(), intent(env.planner.twist(t), t * STEP))
            observation, *_ = env.step(actor(observation))
            v = command.velocity(STEP)
            robot.send(np.append(v, 0.0))
            assert command.diagnostics.status is Status.OK
            assert np.allclose(v, env.velocity, atol=1e-5)
        assert np.abs(v[:3]).max() > 0.01


@pytest.mark.parametrize(
    ("spoil", "status"),
    [
        (lambda good: replace(good, values=np.full(CHANNELS.size, np.nan)), Status.INVALID_INTENT),
        (lambda good: replace(good, values=np.zeros(4)), Status.INVALID_INTENT),
        (lambda good: replace(good, mask=CHANNELS.mask("joint")), Status.INVALID_INTENT),
        (lambda good: replace(good, time=good.time - 1.0), Status.STALE_INTENT),
    ],
)
def test_bad_input_brakes_within_the_limits(controller, spoil, status):
    q, v = MODEL.description.home, np.zeros(9)
    for k in range(30):
        asked = intent([0.2, 0.0, 0.0, 0.0, 0.0, 0.0], k * STEP)
        v = controller.update(State(q, v, k * STEP), asked).velocity(STEP)
    speed = np.linalg.norm(v)
    for k in range(30, 130):
        before, time = v, k * STEP
        command = controller.update(State(q, v, time), spoil(intent(np.zeros(6), time)))
        v = command.velocity(STEP)
        assert command.diagnostics.status is status
        assert np.all(np.abs(v - before) <= MODEL.description.limits.acceleration * STEP + 1e-9)
        assert np.linalg.norm(v) < speed
    assert not command.velocities.any()


def test_a_new_episode_knows_nothing_of_the_one_before(controller):
    def drive():
        q, v = MODEL.description.home, np.zeros(9)
        for k in range(20):
            asked = intent([0.05, 0.1, 0.0, 0.0, 0.0, 0.2], k * STEP)
            v = controller.update(State(q, v, k * STEP), asked).velocity(STEP)
            q = q + STEP * v
        return q

    first = drive()
    controller.aim(Pose(np.array([0.5, 0.5, 0.8]), np.eye(3)))
    second = drive()
    controller.reset()
    assert not np.allclose(first, second)
    assert np.array_equal(first, drive())
