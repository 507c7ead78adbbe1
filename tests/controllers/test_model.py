"""The model's laws: CasADi agrees with pinocchio, the description is checked."""

import pickle
import re
from threading import Thread

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.frames import Frames
from handrail.controllers.objectives.objective import Stage
from handrail.controllers.objectives.tracking import channel_velocities
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.robot.description import load_description
from handrail.controllers.robot.model import load_model
from handrail.controllers.robot.symbolic import symbolic_pose

MODEL = load_model()
N = MODEL.size


@pytest.mark.parametrize("frame", ["tool", "forearm_link", "planar_base"])
def test_casadi_agrees_with_pinocchio(frame):
    q = ca.SX.sym("q", N)
    pose = symbolic_pose(MODEL, q, frame)
    function = ca.Function("pose", [q], [pose.position, pose.rotation, pose.jacobian])
    rng = np.random.default_rng(0)
    for _ in range(50):
        x = rng.uniform(-3.0, 3.0, N)
        position, rotation, jacobian = (np.array(value) for value in function(x))
        expected = MODEL.pose(x, frame)
        np.testing.assert_allclose(position.ravel(), expected.position, atol=1e-9)
        np.testing.assert_allclose(rotation, expected.rotation, atol=1e-9)
        np.testing.assert_allclose(jacobian, MODEL.jacobian(x, frame), atol=1e-9)


def test_threads_that_share_a_model_get_their_own_poses(monkeypatch):
    """Whatever another thread asks for in the midst of it."""
    home, update = MODEL.description.home, pin.updateFramePlacement
    expected = MODEL.pose(home)

    def interrupted(*args):
        monkeypatch.setattr(pin, "updateFramePlacement", update)
        (other := Thread(target=lambda: MODEL.pose(home + 0.3))).start()
        other.join()
        return update(*args)

    monkeypatch.setattr(pin, "updateFramePlacement", interrupted)
    pose = MODEL.pose(home)
    np.testing.assert_array_equal(pose.position, expected.position)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(MODEL)).pose(home).rotation, expected.rotation)


@pytest.mark.parametrize("q", [np.zeros(N - 1), np.zeros((N, 1)), [0.0] * (N + 1), None, "home", 0.0])
@pytest.mark.parametrize("ask", [MODEL.pose, MODEL.jacobian])
def test_a_configuration_that_is_none_is_one_line(ask, q):
    with pytest.raises(HandrailError, match=r"^configuration: expected [^\n]+, got [^\n]+$"):
        ask(q)
    np.testing.assert_array_equal(MODEL.jacobian([0] * N), MODEL.jacobian(np.zeros(N)))


def test_channel_velocities_are_what_moves():
    """Base twist in the base frame and tool twist in the world, against finite differences of poses."""
    channels = Channels.of(MODEL.description)
    q, v, u = ca.SX.sym("q", N), ca.SX.sym("v", N), ca.SX.sym("u", N)
    stage, p = Stage(MODEL, q, v, u), ca.SX.sym("p", 5)
    function = ca.Function("c", [q, v, p], [channel_velocities(stage, channels, p)])
    rng = np.random.default_rng(1)
    for _ in range(20):
        x, rate, h = rng.uniform(-2, 2, N), rng.uniform(-1, 1, N), 1e-6
        values = np.array(function(x, rate, Frames().parameters)).ravel()
        now, later = MODEL.pose(x, "planar_base"), MODEL.pose(x + h * rate, "planar_base")
        linear = now.rotation.T @ (later.position - now.position) / h
        np.testing.assert_allclose(values[:2], linear[:2], atol=1e-4)
        np.testing.assert_allclose(values[2], rate[2])
        now, later = MODEL.pose(x), MODEL.pose(x + h * rate)
        np.testing.assert_allclose(values[3:6], (later.position - now.position) / h, atol=1e-4)
        spin = (later.rotation - now.rotation) / h @ now.rotation.T
        np.testing.assert_allclose(values[6:9], [spin[2, 1], spin[0, 2], spin[1, 0]], atol=1e-4)
        np.testing.assert_allclose(values[9:], rate)


def test_home_puts_the_tool_where_the_robot_has_it():
    home = MODEL.description.home
    np.testing.assert_allclose(MODEL.pose(home, "tool0").position, [-0.300, 0.174, 0.703], atol=1e-3)
    np.testing.assert_allclose(MODEL.pose(home).position, [-0.010, 0.174, 0.703], atol=1e-3)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[home]", "[home", "not valid TOML"),
        ('name = "ridgeback_ur10"', "", "expected an entry 'name'"),
        ("mass = 165.3", "mas = 165.3", "base: unknown entry 'mas'"),
        ("box = [0.960, 0.793, 0.28]", "box = [0.960, -1.0, 0.28]", "collision[0]: box: expected"),
        ("acceleration = [1.0,", "acceleration = [0.0,", "acceleration: expected a number >= 1e-06 at [0]"),
        ("q = [-1.5,", "q = [", "home: q: expected 9 numbers, one a joint, got 8"),
        ("effort = [2000.0, ", "effort = [", "effort: expected 9 numbers"),
        ("q = [-1.5,", "q = [-3.5,", "home of joint x: expected -3.0 to 3.0, got -3.5"),
        ("lower = [-3.0,", "lower = [3.0,", "expected position_lower below position_upper"),
        ("capsule = 0.08", "capsule = 0.08\nbox = [1.0, 1.0, 1.0]", "got box and capsule"),
        ("b = [0.27, 0.01, 0.63]", "b = [0.27, 0.01, 0.28]", "expected a capsule from a to b, apart"),
        ('["chassis", "upper_arm"]', '["chassis", "tail"]', "collision shape 'tail'"),
        ('["chassis", "upper_arm"]', '["chassis", "elbow"]', "pairs: expected each once"),
        ("[hand.gripper]", '[hand.gripper]\nshape = "paw"', "collision shape 'paw'"),
        ('name = "mount"', 'name = "chassis"', "collision: expected each once, got 'chassis' twice"),
        ('"shoulder_pan_joint"', '"shoulder_lift_joint"', "joints: expected each once"),
        ('urdf = "example', 'urdf = "no-such', "URDF no-such-robot-data"),
        ('urdf = "example', 'urdf = "robot.urdf" #', "URDF robot.urdf: expected it beside"),
        ('urdf = "example', 'urdf = "" #', "urdf: expected a text of length"),
    ],
)
def test_a_wrong_description_says_what_is_wrong(tmp_path, old, new, words):
    """What types refuse in any file is tested once, in test_typed.py."""
    text = ROBOTS["ridgeback_ur10"].file.read_text()
    assert old in text
    path = tmp_path / "robot.toml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(HandrailError, match=re.escape(words)):
        load_description(path)
