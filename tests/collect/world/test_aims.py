"""Where tasks say that the hand is to be brought: the judge agrees, and it changes as the task goes on."""

from dataclasses import replace

import numpy as np
import pytest
from collect_helpers import environment, over_cube
from scipy.spatial.transform import Rotation

from handrail.controllers.robot.model import Pose


def aim_of(env, state):
    aim = env.task.aim(state)
    assert aim is not None
    return aim


@pytest.mark.parametrize("scale", [1.0, 0.2])
def test_a_person_is_told_the_judge_s_goal(scale):
    """Within the distance and the angle of the aim, and only there, the goal is reached."""
    rng, told = np.random.default_rng(0), []
    with environment("Reach") as env:
        env.reset(seed=0)
        state = replace(env.task_state(), scale=scale)
        for _ in range(400):
            aim = aim_of(env, state)
            turn = rng.uniform(0.0, 2.0) * aim.angle * _direction(rng)
            place = aim.position + rng.uniform(0.0, 2.0) * aim.distance * _direction(rng)
            now = replace(state, tools=(Pose(place, aim.rotation @ Rotation.from_rotvec(turn).as_matrix()),))
            near = np.linalg.norm(place - aim.position) <= aim.distance
            told.append(bool(near and np.linalg.norm(turn) <= aim.angle))
            assert env.task.outcome(now).success == told[-1]
    assert 50 < sum(told) < 350


def _direction(rng):
    drawn = rng.normal(size=3)
    return drawn / np.linalg.norm(drawn)


def done(env, state, position):
    """Return what the judge says of an open hand 7.9 and 8.1 cm from a place, on all of its six sides."""

    def around(far):
        tools = [Pose(position + far * side, np.eye(3)) for side in (*np.eye(3), *-np.eye(3))]
        return {env.task.outcome(replace(state, openings=(1.0,), tools=(tool,))).success for tool in tools}

    return around(0.079), around(0.081)


def test_the_hand_is_led_to_the_handle_of_the_drawer_however_far_it_is_open():
    """Who holds it has not let go, and who is 8 cm away has."""
    with environment("Drawer") as env:
        env.reset(seed=1)
        state, into = env.task_state(), env.task_state().object("cabinet").rotation[:, 0]
        shut = state.pose("drawer")
        poses = {**state.poses, "drawer": Pose(shut.position - 0.3 * into, shut.rotation)}
        state = replace(state, poses=poses)
        aim = aim_of(env, state)
        assert done(env, state, aim.position) == ({False}, {True})
        assert aim.rotation is not None
        np.testing.assert_allclose(aim.rotation[:, 2], into, atol=1e-9)


def test_the_hand_is_led_to_where_it_puts_the_tray_on_the_middle_of_the_table():
    with environment("Tray") as env:
        env.reset(seed=1)
        state, table = env.task_state(), env.task_state().object("table")
        place = np.array([*table.position[:2], table.top])
        can = Pose(place + [0.0, 0.0, 0.05], np.eye(3))
        poses = {**state.poses, "tray": Pose(place, np.eye(3)), "can": can}
        state, aim = replace(state, poses=poses, still=frozenset({"tray"})), aim_of(env, state)
        assert done(env, state, aim.position) == ({False}, {True})


def test_the_hand_is_led_to_the_cube_then_to_the_bin():
    with environment("PickPlace") as env:
        env.reset(options={"start": over_cube(env, 3, 0.0)})
        state = env.task_state()
        aim = aim_of(env, state)
        assert aim.name == "cube"
        np.testing.assert_allclose(aim.position, state.pose("cube").position)
        assert aim.rotation is not None
        np.testing.assert_allclose(aim.rotation, state.tool.rotation, atol=1e-3)
        taken = aim_of(env, replace(state, openings=(0.5,)))
        assert taken.name == "bin"
        assert taken.position[2] > state.object("bin").top
