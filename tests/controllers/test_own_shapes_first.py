"""The robot does not give up its distance to itself because something else has come too near."""

import numpy as np
import pytest
from ideal_robot import HOME, LIMITS, MODEL, PERIOD, Robot, asking

from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.trajectory import Trajectory
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.robot.model import load_model
from handrail.controllers.robot.shape import Obstacle, Shape
from handrail.controllers.safety.backup import Backup, Situation
from handrail.controllers.safety.certificate import Violation
from handrail.controllers.safety.limiter import Limiter

OWN = len(MODEL.description.self_pairs)


@pytest.mark.parametrize("speed", [0.0, 0.5])
def test_a_near_obstacle_buys_no_slack_to_the_robot_itself(speed):
    """The wrist is turned towards the robot as far as it may; a ball is in the chassis, at rest or moving."""
    mpc = MaskedMpc(MODEL)
    turning = np.arange(mpc.channels.size) == mpc.channels.joint_slice.start + 7
    ask = asking(1.0 * turning, "joint")
    robot = Robot(mpc)
    for _ in range(30):
        robot.update(ask(robot.time))
    ball = Obstacle(
        "ball", Shape("sphere", [0.1]), [robot.q[0] - 0.53, 0.0, 0.14], velocity=[speed, 0.0, 0.0]
    )
    mpc.reset((ball,))
    problem = mpc.build_problem(State(robot.q, np.zeros(MODEL.size), 0.0), ask(0.0))
    plan = mpc.solver.solve(problem, np.zeros((mpc.settings.horizon, MODEL.size)))
    for _ in range(5):
        plan = mpc.solver.solve(problem, plan.u)
    assert plan.collision_slack > 0.03  # to the ball, which nothing can be done about at once
    short = problem.margins[:OWN] - problem.collision.values(plan.q)[:, :OWN]
    assert short.max() < 1e-3


class Judge:
    """Says that a full stop is unsafe to the robot itself; what is followed, more so, but only to a mover."""

    def violation(self, motion, q, distances):
        stops = np.abs(motion.velocities[1]).max() < np.abs(motion.velocities[0]).max()
        return Violation(0.01, 0.01, 0.0) if stops else Violation(0.0, 0.05, 0.0)


@pytest.mark.parametrize("halt", [True, False])
def test_of_two_ways_that_are_not_safe_the_one_is_taken_that_keeps_from_itself(halt):
    backup, moving = Backup(Judge(), Limiter(MODEL.description), 0.1), 0.3 * LIMITS.velocity  # pyright: ignore
    followed = Trajectory(backup.limiter.to_rest(np.stack([moving, moving]), backup.dt), backup.dt)
    way = backup.choose(Situation(HOME, moving, np.zeros(OWN), followed, 0.0), None, halt)
    assert way.violation == (0.0, 0.05, 0.0)


@pytest.mark.parametrize("pose", [(-1.55, 1.5, 1.5), (-1.65, 1.6, 1.3)])
def test_an_arm_folded_onto_itself_unfolds(pose):
    """Its shapes overlap a little; on the way out other pairs come a little nearer, none so deep."""
    model = load_model("lekiwi")
    home, mpc = model.description.home, MaskedMpc(model)
    q, v = np.array(home), np.zeros(model.size)
    q[4:7] = pose
    own = mpc.loop.surroundings.collision
    deepest = own.values(q[None])[0].min()
    assert deepest < 0.0
    mask, values = mpc.channels.mask("joint"), np.zeros(mpc.channels.size)
    for step in range(200):
        values[mpc.channels.joint_slice] = np.clip(2.0 * (home - q), -0.5, 0.5)
        command = mpc.update(State(q, v, step * PERIOD, v), Intent(values, mask, time=step * PERIOD))
        q, v = q + 0.5 * PERIOD * (v + command.velocity(PERIOD)), command.velocity(PERIOD)
        assert own.values(q[None])[0].min() > deepest - 1e-3
    np.testing.assert_allclose(q, home, atol=0.02)
