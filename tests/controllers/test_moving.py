"""Moving obstacles: no contact where a stop or an evasive motion can avoid it."""

import numpy as np
import pytest
from ideal_robot import HOME, MODEL, PERIOD, Robot, intent

from handrail.controllers.interface.command import Status
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.robot.shape import Obstacle, Shape
from handrail.controllers.safety.backup import Backup

SPEED = 0.5


def meet(obstacle, values, groups, seconds=8.0):
    """Run the MPC against an obstacle that moves; return the smallest true distance and the path."""
    robot, path = Robot(MaskedMpc(MODEL), (obstacle,)), []
    for _ in range(int(seconds / PERIOD)):
        robot.update(intent(values, *groups, time=robot.time))
        path.append(robot.q)
    return robot.smallest, np.array(path)


def pillar(position, velocity, height=1.0, radius=0.2):
    return Obstacle(
        "walker", Shape("cylinder", [radius, height]), [*position, height / 2], velocity=[*velocity, 0.0]
    )


@pytest.mark.parametrize("start", [-2.0, -1.6, -1.2])
def test_the_base_lets_a_crossing_pillar_pass(start):
    """The operator drives ahead; a pillar crosses the way at 0.5 m/s."""
    smallest, path = meet(pillar((0.2, start), (0.0, SPEED)), {"base.vx": 0.4}, ("base",))
    assert smallest > 0.0
    assert path[-1, 0] > HOME[0] + 0.5  # and goes on afterwards


def test_the_robot_steps_aside_when_nobody_commands():
    """Something comes straight at a robot that stands still: a stop does not help, an evasive motion does."""
    smallest, path = meet(pillar((-1.4, -2.5), (0.0, SPEED), height=0.5), {}, (), seconds=9.0)
    assert smallest > 0.0
    assert np.abs(path[:, :2] - HOME[:2]).max() > 0.2


def test_the_arm_moves_out_of_the_way_while_the_base_is_held():
    """A lamp-like ball crosses the hand's place; the base is commanded to rest."""
    ball = Obstacle("ball", Shape("sphere", [0.1]), [-0.1, -1.5, 0.75], velocity=[0.0, SPEED, 0.0])
    smallest, path = meet(ball, {}, ("base",), seconds=7.0)
    assert smallest > 0.0
    assert np.abs(path[:, :3] - HOME[:3]).max() < 0.3


def test_what_is_not_certified_is_no_ok(monkeypatch):
    """Something comes too near to be avoided: the least bad motion may be a part of the plan."""
    chosen, choose = [], Backup.choose

    def noted(self, situation, plan, halt=False):
        chosen.append(choose(self, situation, plan, halt))
        return chosen[-1]

    monkeypatch.setattr(Backup, "choose", noted)
    robot = Robot(MaskedMpc(MODEL), (pillar((HOME[0] + 1.2, HOME[1]), (-SPEED, 0.0)),))
    for _ in range(60):
        robot.update(intent({"base.vx": 0.6}, "base", time=robot.time))
    unsafe = [each.violation.all > 0.0 for each in chosen]
    planned = [way.planned > 0.0 for way, bad in zip(chosen, unsafe, strict=True) if bad]
    assert any(planned)
    statuses = [each.diagnostics.status for each, bad in zip(robot.commands, unsafe, strict=True) if bad]
    assert set(statuses) == {Status.BACKUP}
