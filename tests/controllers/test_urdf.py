"""A URDF is the robot that it says, as pinocchio reads it, or one line says what is wrong with it."""

import re
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from handrail.controllers.errors import HandrailError
from handrail.controllers.modelling.clouds import hull, link_clouds
from handrail.controllers.modelling.limits import arm_limits
from handrail.controllers.modelling.making import RobotMaker
from handrail.controllers.modelling.source import Source
from handrail.controllers.modelling.standing import cameras

INERTIA = '<mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>'
BOX = '<collision><geometry><box size="0.1 0.1 0.2"/></geometry></collision>'
LINK = f'<link name="%s"><inertial>{INERTIA}</inertial>{BOX}</link>'
JOINT = (
    '<joint name="%s" type="%s"><parent link="%s"/><child link="%s"/>'
    '<origin xyz="0 0.02 0.3" rpy="0.1 0 0.2"/><axis xyz="%s"/>'
    '<limit lower="-1" upper="1.5" velocity="2" effort="50"/></joint>'
)
KINDS = (  # of the joints of a chain, and their axes
    ("revolute", "0 0 1"),
    ("continuous", "0.6 0 -0.8"),
    ("fixed", "0 0 1"),
    ("prismatic", "0 1 0"),
    ("revolute", "0 -2 0"),
    ("prismatic", "0.8 0 0.6"),
)
CHAIN = "".join(JOINT % (f"j{k}", kind, f"l{k}", f"l{k + 1}", axis) for k, (kind, axis) in enumerate(KINDS))
URDF = f'<robot name="chain">{"".join(LINK % f"l{k}" for k in range(7))}{CHAIN}</robot>'


def maker(folder: Path, text: str, base: str = "planar") -> RobotMaker:
    (folder / "chain.urdf").write_text(text)
    return RobotMaker(Source.find(str(folder / "chain.urdf")), "chain", {"": "l6"}, base)


def read_all(tmp_path: Path, text: str) -> None:
    made = maker(tmp_path, text)
    arm_limits(made.tables, made.model(), np.random.default_rng(0))
    link_clouds(made.model())


def test_every_frame_is_where_pinocchio_has_it(tmp_path):
    """The base ahead, a joint that turns without an end as one that turns."""
    model = maker(tmp_path, URDF).model()
    robot = pin.buildModelFromXML(URDF.replace("continuous", "revolute"))
    for q in np.random.default_rng(0).uniform(-1.0, 1.5, (20, robot.nq)):
        data, base = robot.createData(), np.array([0.4, -0.7, 2.0])
        pin.framesForwardKinematics(robot, data, q)
        ahead = pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, base[2]), np.array([*base[:2], 0.0]))
        for link in (f"l{k}" for k in range(7)):
            pose, there = model.pose(np.append(base, q), link), ahead * data.oMf[robot.getFrameId(link)]
            np.testing.assert_allclose(pose.position, there.translation, atol=1e-9)
            np.testing.assert_allclose(pose.rotation, there.rotation, atol=1e-9)


COVER = LINK % "cover" + JOINT % ("jc", "revolute", "l0", "cover", "1 0 0")
COVER = COVER.replace("</joint>", '<mimic joint="j1"/></joint>')
WRONG = {  # what is changed in the URDF, and what the line says
    "mimic_in_the_chain": ('(name="j4".*?/>)(</joint>)', r'\1<mimic joint="j1"/>\2', "j4 follows j1"),
    "mimic_of_the_chain": ("(</robot>)", rf"{COVER}\1", "jc follows j1"),
    "no_mass": ('<mass value="1"/>', "", "must have a mass element; .*l0"),
    "no_inertia": ("<inertia .*?/>", "", "must have inertia element; .*l0"),
    "half_a_box": ('0.1 0.1 0.2"', '0.1 0.1"', "Parser found 2 elements but 3 expected"),
    "a_capsule": ("<box size.*?/>", '<capsule radius="1" length="1"/>', "collision element for Link .l0"),
    "no_limit": ("<limit.*?/>", "", "j0. is of type REVOLUTE but it does not specify limits"),
    "two_roots": ("(</robot>)", LINK % "other" + r"\1", "Two root links found"),
    "swapped": (
        'lower="-1" upper="1.5"',
        'lower="1.5" upper="-1"',
        "j0: expected position_lower below",
    ),
    "joint_as_a_link": ('name="j3"', 'name="l2"', "links and joints: expected each once, got 'l2'"),
    "joint_as_the_base_s": ('name="j3"', 'name="theta"', "expected each once, got 'theta'"),
    "link_as_the_tool": ('"l3"', '"tool"', "expected each once, got 'tool'"),
    "link_as_the_base": ('"l3"', '"planar_base"', "expected each once, got 'planar_base'"),
}


@pytest.mark.parametrize("case", WRONG)
def test_faults_of_a_urdf_are_one_line(case, tmp_path, capfd):
    pattern, other, told = WRONG[case]
    text, count = re.subn(pattern, other, URDF, count=0 if '"l3"' in pattern else 1, flags=re.DOTALL)
    assert count
    with pytest.raises(HandrailError, match=told) as error:
        read_all(tmp_path, text)
    assert "\n" not in str(error.value)
    assert capfd.readouterr() == ("", "")


def test_fingers_may_follow_each_other(tmp_path):
    fingers = "".join(
        LINK % name + JOINT % (f"j{name}", "prismatic", "l6", name, axis)
        for name, axis in (("left", "0 1 0"), ("right", "0 -1 0"))
    )
    text = URDF.replace("</robot>", f"{fingers}</robot>")
    text = re.sub('(name="jright".*?/>)(</joint>)', r'\1<mimic joint="jleft"/>\2', text)
    assert maker(tmp_path, text).model().joints == ("x", "y", "theta", "j0", "j1", "j3", "j4", "j5")


def test_a_hand_that_points_straight_up_has_a_camera(tmp_path):
    upright = re.sub(r'xyz="0 0.02 0.3" rpy="0.1 0 0.2"', 'xyz="0 0 0.3"', URDF)
    for camera in cameras(maker(tmp_path, upright).model()):
        assert np.isfinite(camera["position"]).all()


def test_joints_that_stand_still_stand_where_they_can(tmp_path):
    """Nearest to 0 in their range; followers where the URDF puts them for that."""
    lift = JOINT % ("jled", "prismatic", "l6", "led", "0 0 1")
    lift = lift.replace('lower="-1" upper="1.5"', 'lower="0.1" upper="0.4"')
    behind = JOINT % ("jfollow", "prismatic", "led", "follow", "0 0 1")
    behind = behind.replace("</joint>", '<mimic joint="jled" multiplier="-2" offset="0.03"/></joint>')
    text = URDF.replace("</robot>", f"{LINK % 'led'}{lift}{LINK % 'follow'}{behind}</robot>")
    model = maker(tmp_path, text).model().pinocchio
    l6, led, follow = (model.frames[model.getFrameId(name)].placement for name in ("l6", "led", "follow"))
    origin = pin.SE3(pin.rpy.rpyToMatrix(0.1, 0.0, 0.2), np.array([0.0, 0.02, 0.3]))
    for on, out in ((l6.actInv(led), 0.1), (led.actInv(follow), 0.03 - 2.0 * 0.1)):
        there = origin * pin.SE3(np.eye(3), np.array([0.0, 0.0, out]))
        np.testing.assert_allclose(on.homogeneous, there.homogeneous, atol=1e-12)


def test_a_hull_of_few_points_is_these_points():
    assert hull(np.eye(3)).tolist() == np.eye(3).tolist()
