"""LeKiwi: LeRobot's figures, the URDF's arm, a jaw that turns, and a world that is small."""

import itertools

import numpy as np
import pinocchio as pin
import pytest

from handrail.collect.world.scene import Scene
from handrail.collect.world.simulation import Simulation
from handrail.collect.world.tasks.drawer import Drawer
from handrail.collect.world.tasks.furniture import cube
from handrail.collect.world.tasks.reach import Reach, sample_goal_for
from handrail.collect.world.tasks.tray import Tray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.robot.description import load_description
from handrail.controllers.robot.inverse_kinematics import body_configuration
from handrail.controllers.robot.model import load_model

MODEL = load_model("lekiwi")
ROBOT = MODEL.description
HOME = np.array(ROBOT.home)


def test_no_command_inside_the_limits_turns_a_wheel_faster_than_lerobot_lets_it():
    """Any drive and turn at once, whatever the heading: LeRobot would slow nothing down.

    Its figures (`lerobot/robots/lekiwi/lekiwi.py`): a wheel that drives in direction a rolls at
    `cos a vx + sin a vy + 0.125 ω` [m/s]; its radius is 0.05 m, 4096 ticks are a turn, 3000 ticks/s the most.
    """
    directions, most = np.radians([150.0, -90.0, 30.0]), 3000.0
    wheels = np.column_stack([np.cos(directions), np.sin(directions), np.full(3, 0.125)])
    corners = np.array(list(itertools.product([-1.0, 1.0], repeat=3))) * ROBOT.limits.velocity[:3]
    fastest = 0.0
    for heading in np.linspace(0.0, 2 * np.pi, 73):
        body = np.column_stack([turned(corner, -heading) for corner in corners])
        ticks = wheels @ body / 0.05 * 4096 / (2 * np.pi)
        fastest = max(fastest, float(np.abs(ticks).max()))
    assert 0.95 * most < fastest <= most


def test_the_arm_is_the_urdfs():
    """Its ranges; and the hand is where the URDF alone has it on the base, for any configuration."""
    arm = pin.buildModelFromUrdf(str(ROBOT.arms[0].urdf))
    data, first = arm.createData(), len(ROBOT.base.joints)
    np.testing.assert_allclose(ROBOT.limits.position_lower[first:], arm.lowerPositionLimit[:5])
    np.testing.assert_allclose(ROBOT.limits.position_upper[first:], arm.upperPositionLimit[:5])
    rng = np.random.default_rng(0)
    for _ in range(20):
        q = rng.uniform(ROBOT.limits.position_lower, ROBOT.limits.position_upper)
        pin.framesForwardKinematics(arm, data, np.append(q[first:], 0.0))
        hand = data.oMf[arm.getFrameId(ROBOT.hands[0].frame)]
        base = pin.SE3(pin.exp3(np.array([0.0, 0.0, q[2]])), np.array([q[0], q[1], 0.0]))
        mount = pin.SE3(np.eye(3), np.array(ROBOT.arms[0].mount.translation))
        expected = base * mount * hand
        tool = MODEL.pose(q)
        np.testing.assert_allclose(tool.rotation, expected.rotation, atol=1e-9)
        place = expected.act(np.array(ROBOT.hands[0].placement.translation))
        np.testing.assert_allclose(tool.position, place, atol=1e-9)


def test_home_keeps_every_margin():
    distances = CollisionModel(MODEL).values(HOME[None])[0]
    assert distances.min() >= 0.10 * ROBOT.world.scale


def test_the_jaw_picks_a_cube_up_and_lets_it_go():
    tool = MODEL.pose(HOME)
    edge, mass = ROBOT.world.cube, 0.0125
    x, y, z = map(float, tool.position)
    thing = cube(x, y, z - edge / 2, 0.0, edge, mass)
    simulation = Simulation(MODEL, Scene((thing,)), HOME, 0.05)
    simulation.mujoco_model.opt.gravity[:] = 0.0  # until it is held
    for _ in range(30):
        simulation.send(np.append(np.zeros(MODEL.size), 1.0))
    assert [item.name for item in simulation.held()] == ["cube"]
    simulation.mujoco_model.opt.gravity[2] = -9.81
    lift = np.zeros(MODEL.size + 1)
    lift[4], lift[-1] = -0.3, 1.0  # the shoulder lifts
    before = simulation.poses()["cube"].position[2]
    for _ in range(30):
        simulation.send(lift)
    assert simulation.poses()["cube"].position[2] > before + 0.02
    assert simulation.contacts == ()
    for _ in range(20):
        simulation.send(np.zeros(MODEL.size + 1))
    assert simulation.held() == ()
    assert simulation.poses()["cube"].position[2] < before


def test_goals_are_inside_its_world_and_within_reach():
    world = ROBOT.world
    for seed in range(6):
        goal, again = (sample_goal_for(MODEL, np.random.default_rng(seed)) for _ in range(2))
        np.testing.assert_array_equal(goal.position, again.position)
        assert np.all(np.abs(goal.position[:2]) <= world.scale)
        assert world.goals[0] <= goal.position[2] <= world.goals[1]
        pitch = np.arcsin(-goal.rotation[2, 2])
        assert world.pitch[0] - 1e-9 <= pitch <= world.pitch[1] + 1e-9
        assert body_configuration(MODEL, HOME, goal)[1] < 1e-3


@pytest.mark.parametrize("task", [Tray, Drawer])
def test_a_task_for_larger_robots_says_so(task):
    with pytest.raises(HandrailError, match=r"expected a robot whose world has scale 1, got lekiwi"):
        task().sample(MODEL, np.random.default_rng(0))
    Reach().sample(MODEL, np.random.default_rng(0))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("open = 0.5", "open = 0.0", r"gripper: jaw: expected closed <= parallel < open"),
        ("gap = 0.0235", "gap = 0.0", r"gripper: jaw: .*gap"),
        ("scale = 0.3", "scale = 0.0", r"world: .*scale"),
        ("goals = [0.12, 0.26]", "goals = [0.26, 0.12]", "the lowest and the highest"),
    ],
)
def test_a_jaw_or_a_world_that_makes_no_sense_is_refused(tmp_path, old, new, said):
    text = ROBOTS["lekiwi"].file.read_text()
    assert old in text
    path = tmp_path / "robot.toml"
    path.write_text(text.replace(old, new))
    with pytest.raises(HandrailError, match=said):
        load_description(path)
