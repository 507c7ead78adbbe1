"""Moving obstacles: no contact where a stop or an evasive motion can avoid it."""

from dataclasses import replace

import numpy as np
import pytest

from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.robot.model import load_model
from handrail.controllers.robot.shape import Obstacle, Shape

MODEL = load_model()
HOME = MODEL.description.home
PERIOD = 0.05
SPEED = 0.5


def meet(obstacle, values, groups, seconds=8.0):
    """Run the MPC against an obstacle that moves; return the smallest true distance and the path."""
    mpc = MaskedMpc(MODEL)
    mpc.reset((obstacle,))
    truth = CollisionModel(MODEL, (obstacle,))
    mask = mpc.channels.mask(*groups)
    q, v, smallest, path = np.array(HOME), np.zeros(9), np.inf, []
    for k in range(int(seconds / PERIOD)):
        time = k * PERIOD
        seen = replace(obstacle, position=obstacle.position + time * obstacle.velocity)
        mpc.update_scene((seen,))
        truth.update_scene((replace(seen, velocity=np.zeros(3)),))
        smallest = min(smallest, truth.values(q[None])[0].min())
        after = mpc.update(State(q, v, time), Intent(values, mask, time=time)).velocity(PERIOD)
        q, v = q + PERIOD * 0.5 * (v + after), after
        path.append(q)
    return smallest, np.array(path)


def pillar(position, velocity, height=1.0, radius=0.2):
    return Obstacle(
        "walker", Shape("cylinder", [radius, height]), [*position, height / 2], velocity=[*velocity, 0.0]
    )


@pytest.mark.parametrize("start", [-2.0, -1.6, -1.2])
def test_the_base_lets_a_crossing_pillar_pass(start):
    """The operator drives ahead; a pillar crosses the way at 0.5 m/s."""
    values = np.zeros(18)
    values[0] = 0.4
    smallest, path = meet(pillar((0.2, start), (0.0, SPEED)), values, ("base",))
    assert smallest > 0.0
    assert path[-1, 0] > HOME[0] + 0.5  # and goes on afterwards


def test_the_robot_steps_aside_when_nobody_commands():
    """Something comes straight at a robot that stands still: a stop does not help, an evasive motion does."""
    smallest, path = meet(pillar((-1.4, -2.5), (0.0, SPEED), height=0.5), np.zeros(18), (), seconds=9.0)
    assert smallest > 0.0
    assert np.abs(path[:, :2] - HOME[:2]).max() > 0.2


def test_the_arm_moves_out_of_the_way_while_the_base_is_held():
    """A lamp-like ball crosses the hand's place; the base is commanded to rest."""
    ball = Obstacle("ball", Shape("sphere", [0.1]), [-0.1, -1.5, 0.75], velocity=[0.0, SPEED, 0.0])
    smallest, path = meet(ball, np.zeros(18), ("base",), seconds=7.0)
    assert smallest > 0.0
    assert np.abs(path[:, :3] - HOME[:3]).max() < 0.3
