"""A robot from a URDF: it can be used as it is, its shapes hold its links, and what is wrong is said."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.modelling.checks import faults
from handrail.controllers.modelling.clouds import link_clouds
from handrail.controllers.modelling.home import freedom
from handrail.controllers.modelling.making import RobotMaker
from handrail.controllers.modelling.pairs import outside
from handrail.controllers.modelling.source import Source
from handrail.controllers.modelling.toml_text import toml_text

AXES = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")


def link(name: str, size: str, at: str = "0 0 0") -> str:
    solid = f'<origin xyz="{at}"/><geometry><box size="{size}"/></geometry>'
    inertia = '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/>'
    body = f'<inertial><origin xyz="{at}"/><mass value="1"/>{inertia}</inertial>'
    return f'<link name="{name}">{body}<collision>{solid}</collision></link>'


def joint(
    name: str, parent: str, child: str, at: str, axis: str, kind: str = "revolute", more: str = ""
) -> str:
    ends = {"revolute": 'lower="-2.5" upper="2.5"', "prismatic": 'lower="0" upper="0.04"'}.get(kind, "")
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{at}"/><axis xyz="{axis}"/><limit {ends} velocity="2" effort="50"/>{more}</joint>'
    )


def arm(side: str, at: str) -> str:
    """Return six joints, the fourth without an end, and a hand with two fingers, the second following."""
    parts, before, away = [], "torso", at
    for number, axis in enumerate(AXES):
        name, long = f"{side}{number}", "0.24 0.07 0.07" if number in (1, 2) else "0.08 0.06 0.06"
        parts.append(link(name, long, f"{float(long.split()[0]) / 2} 0 0"))
        kind = "continuous" if number == 3 else "revolute"
        parts.append(joint(f"{side}_joint{number}", before, name, away, axis, kind))
        before, away = name, f"{long.split()[0]} 0 0"
    for finger, y in (("a", 1), ("b", -1)):
        parts.append(link(f"{side}{finger}", "0.08 0.01 0.02", f"0.04 {0.005 * y} 0"))
        follow = f'<mimic joint="{side}_fa"/>' if finger == "b" else ""
        parts.append(
            joint(f"{side}_f{finger}", before, f"{side}{finger}", away, f"0 {y} 0", "prismatic", follow)
        )
    tip = f'<parent link="{before}"/><child link="{side}_tip"/><origin xyz="0.12 0 0"/>'
    return "".join(parts) + f'<link name="{side}_tip"/><joint name="{side}_t" type="fixed">{tip}</joint>'


URDF = (
    '<robot name="two">'
    + link("base", "0.5 0.4 0.3", "0 0 0.15")
    + link("torso", "0.2 0.3 0.4", "0 0 0.3")
    + joint("lift", "base", "torso", "0 0 0.3", "0 0 1", "prismatic")
    + arm("right", "0.15 -0.2 0.45")
    + arm("left", "0.15 0.2 0.45")
    + "</robot>"
)


def made_in(folder: Path) -> RobotMaker:
    (folder / "two.urdf").write_text(URDF)
    source = Source.find(str(folder / "two.urdf"))
    return RobotMaker(source, "two", {"left": "left_tip", "right": "right_tip"}, "planar").make()


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> RobotMaker:
    return made_in(tmp_path_factory.mktemp("robot"))


@pytest.fixture
def file(made, tmp_path) -> Path:
    (tmp_path / "two.urdf").write_text(URDF)
    path = tmp_path / "two.toml"
    path.write_text(toml_text(made.tables))
    return path


def test_nothing_is_wrong_with_it(file):
    assert faults(file) == []


def test_the_same_urdf_gives_the_same_robot(made, tmp_path):
    assert toml_text(made_in(tmp_path).tables) == toml_text(made.tables)


def test_joints_are_in_the_urdf_s_order_and_have_its_limits(made):
    """A joint that turns without an end turns twice around; all velocities are kept."""
    joints, limits = made.model().joints, made.model().description.limits
    assert joints[3] == "lift"
    assert len(joints) == 3 + 1 + 2 * 6
    endless = joints.index("left_joint3")
    assert limits.position_upper[endless] == pytest.approx(4.0 * np.pi)
    assert limits.position_upper[joints.index("left_joint2")] == 2.5
    np.testing.assert_allclose(
        limits.velocity[3:], 2.0 * (limits.velocity[3:] > 1.5) + 0.1 * (limits.velocity[3:] < 1.5)
    )
    assert any("velocity of lift" in guess for guess in made.guesses)


def test_shapes_enclose_the_links_and_no_link_is_without(made):
    model = made.model()
    for cloud in link_clouds(model):
        own = [placed for placed in model.description.collision if model.mount(placed)[0] == cloud.joint]
        out = np.min([outside(model, placed, cloud.triangles.reshape(-1, 3)) for placed in own], axis=0)
        assert out.max() < 1e-3, cloud.link


def test_two_fingers_of_which_one_follows_are_a_gripper(made):
    for hand in made.model().description.hands:
        assert hand.gripper is not None
        assert hand.gripper.stroke == pytest.approx(0.08, abs=1e-3)
        np.testing.assert_allclose(hand.placement.rotation[:, 2], [1.0, 0.0, 0.0], atol=1e-6)
        np.testing.assert_allclose(np.abs(hand.placement.rotation[:, 0]), [0.0, 1.0, 0.0], atol=1e-6)


def test_home_is_clear_and_has_room(made):
    model = made.model()
    assert CollisionModel(model).values(model.description.home[None]).min() > 0.03
    room, free = freedom(model, model.description.home, 1.0)
    assert room > 0.1
    assert free > 0.03


def test_hands_of_both_arms_can_meet_and_neighbours_are_left_out(made):
    listed = {frozenset(pair) for pair in made.model().description.self_pairs}
    assert frozenset(("left_fingers", "right_fingers")) in listed
    assert frozenset(("left1", "left2")) not in listed


WRONG = {
    "order": (
        r'"left_joint0", "left_joint1"',
        '"left_joint1", "left_joint0"',
        "expected the order x, y, theta, lift",
    ),
    "pairs": (r"pairs = \[\n(?s:.*?)\n\]", "pairs = []", "left_fingers and right_fingers can meet"),
    "fast": (r"velocity = \[1.0", "velocity = [9.0", "velocity of at most 1.5, got 9.0"),
    "faster": (
        r"velocity = \[1.0, 1.0, 0.8, 0.1, 2.0",
        "velocity = [1.0, 1.0, 0.8, 0.1, 3.0",
        "velocity of at most 2, got 3.0",
    ),
    "slow": (
        r"acceleration = \[1.0, 1.0, 0.8, 0.2, 4.0",
        "acceleration = [1.0, 1.0, 0.8, 0.2, 100.0",
        "left_joint0: expected full velocity in",
    ),
    "ends": (
        r"position_upper = \[3.0, 3.0, 6.283185, 0.04, 2.5",
        "position_upper = [3.0, 3.0, 6.283185, 0.04, 2.6",
        "left_joint0: expected positions inside the URDF's -2.5 to 2.5, got -2.5 to 2.6",
    ),
    "room": (r"q = \[((?:[^,]+, ){6})[^,]+", r"q = [\g<1>2.49", "rad from their limits, got 0.010"),
    "thin": (
        r"box = \[0.241, 0.071, 0.071\]",
        "box = [0.024, 0.071, 0.071]",
        "link left1: no collision shape",
    ),
    "urdf": (r'urdf = "two.urdf"', 'urdf = "two.toml"', "URDF"),
    "toml": (r"^name = ", "name ", "not valid TOML"),
}


@pytest.mark.parametrize("case", WRONG)
def test_faults_are_one_line(case, file):
    pattern, other, told = WRONG[case]
    text, count = re.subn(pattern, other, file.read_text(), count=1, flags=re.MULTILINE)
    assert count == 1
    file.write_text(text)
    assert any(told in fault for fault in faults(file)), faults(file)
    assert not [fault for fault in faults(file) if "\n" in fault]


def test_a_home_that_touches_itself_or_is_stretched_out_is_said(file, made):
    joints, q = made.model().joints, np.zeros(made.model().size)
    q[joints.index("left_joint0")], q[joints.index("right_joint0")] = -1.2, 1.2  # stretched arms that cross
    made.tables["home"], before = {"q": q}, made.tables["home"]
    file.write_text(toml_text(made.tables))
    made.tables["home"] = before
    said = faults(file)
    assert any("singularity" in fault for fault in said)
    assert any(re.search("left. and right. overlap by", fault) for fault in said)


def test_a_srdf_leaves_out_only_what_did_not_meet(tmp_path):
    pairs = [("left5", "right5"), ("left0", "right5")]
    lines = "".join(f'<disable_collisions link1="{a}" link2="{b}" reason="User"/>' for a, b in pairs)
    (tmp_path / "two.srdf").write_text(f'<robot name="two">{lines}</robot>')
    met = {frozenset(pair) for pair in pairs}
    assert met <= {frozenset(pair) for pair in made_in(tmp_path).model().description.self_pairs}
    assert Source.find(str(tmp_path / "two.urdf")).disabled_pairs() == met


@pytest.mark.parametrize("hands", [{"": "nowhere"}, {"": "base"}])
def test_a_hand_that_is_none_is_one_line(hands, tmp_path):
    (tmp_path / "two.urdf").write_text(URDF)
    with pytest.raises(HandrailError, match=r"--hands"):
        RobotMaker(Source.find(str(tmp_path / "two.urdf")), "two", hands, "planar")


def test_pinocchio_agrees_on_where_the_hands_are(made, tmp_path):
    (tmp_path / "two.urdf").write_text(URDF.replace('type="continuous"', 'type="revolute"'))
    urdf = pin.buildModelFromUrdf(str(tmp_path / "two.urdf"))
    data, q = urdf.createData(), np.zeros(urdf.nq)
    pin.framesForwardKinematics(urdf, data, q)
    tip = data.oMf[urdf.getFrameId("left_tip")].translation
    np.testing.assert_allclose(
        made.model().pose(np.zeros(made.model().size), "left_tip").position, tip, atol=1e-6
    )


def one_arm(
    names: Sequence[str], bodies: Mapping[int, str], effort: str = 'effort="50"', hand: str = ""
) -> str:
    """Return the URDF of an arm of six joints on its base, some of its links with bodies of their own."""
    parts, away = [link(names[0], "0.12 0.12 0.1", "0 0 0.05")], "0 0 0.15"
    for number, axis in enumerate(AXES):
        name, long = names[number + 1], 0.3 if number in (1, 2) else 0.1
        plain = link(name, f"{long} 0.06 0.06", f"{long / 2} 0 0")
        before, mark, own = plain.partition("<collision>")
        parts.append(before + (bodies[number] + "</link>" if number in bodies else mark + own))
        parts.append(joint(f"j{number}", names[number], name, away, axis).replace('effort="50"', effort))
        away = f"{long + 0.02} 0 0"
    tip = f'<parent link="{names[-1]}"/><child link="tip"/><origin xyz="0.12 0 0"/>'
    end = f'<link name="tip"/><joint name="t" type="fixed">{tip}</joint>'
    return f'<robot name="one">{"".join(parts)}{hand}{end}</robot>'


def one_made(folder: Path, text: str) -> RobotMaker:
    (folder / "one.urdf").write_text(text)
    return RobotMaker(Source.find(str(folder / "one.urdf")), "one", {"": "tip"}, "planar").make()


NAMES = ("base", "l1", "arm", "l3", "l4", "l5", "l6")
TOWER = (
    '<collision><origin xyz="0.6 0 0.25"/><geometry><box size="0.06 0.06 0.5"/></geometry></collision>'
    '<collision><origin xyz="0.3 0 0"/><geometry><box size="0.6 0.06 0.06"/></geometry></collision>'
)


@pytest.mark.parametrize("word", ["arm_2", "chassis", "column", "floor"])
def test_no_piece_of_a_body_takes_a_name_that_something_else_has(word, tmp_path):
    names = [*NAMES[:3], word, *NAMES[4:]]
    made = one_made(tmp_path, one_arm(names, {1: TOWER}))
    model = made.model()
    shapes = model.description.collision
    assert len({shape.name for shape in shapes}) == len(shapes)
    for cloud in link_clouds(model):
        points = cloud.triangles.reshape(-1, 3)
        own = [shape for shape in shapes if model.mount(shape)[0] == cloud.joint]
        away = np.min([outside(model, shape, points) for shape in own], axis=0)
        assert away.max() < 0.01, cloud.link


@pytest.mark.parametrize(("said", "limit"), [("0", 400.0), ("50000", 400.0)])
def test_an_effort_that_is_replaced_is_a_guess(said, limit, tmp_path):
    made = one_made(tmp_path, one_arm(NAMES, {}, f'effort="{said}"'))
    assert set(made.tables["limits"]["effort"][3:]) == {limit}
    assert f"effort of j0: 400, the URDF says {said}" in made.guesses


@pytest.mark.parametrize("y", [0.0, 0.02])
def test_fingers_that_do_not_move_apart_are_no_gripper(y, tmp_path):
    hand = "".join(
        link(f"f{side}", "0.08 0.01 0.02", "0.04 0 0")
        + joint(f"fj{side}", "l6", f"f{side}", f"0.12 {side * y} 0", "0 1 0", "prismatic")
        for side in (0, 1)
    )
    made = one_made(tmp_path, one_arm(NAMES, {}, hand=hand))
    assert "gripper" not in made.tables["hand"][0]
    assert any("no gripper, for it has not two fingers that move apart" in guess for guess in made.guesses)


def test_a_link_that_can_hit_the_one_that_carries_it_is_named(tmp_path):
    post = '<collision><origin xyz="0 0 0.15"/><geometry><box size="0.06 0.06 0.3"/></geometry></collision>'
    guesses = one_made(tmp_path, one_arm(NAMES, {0: post})).guesses
    (said,) = (guess for guess in guesses if guess.startswith("neighbours that can touch"))
    assert "l1 – arm (" in said
    assert "l5 – l6" not in said  # which turn about the axis along them


def test_a_srdf_leaves_out_what_never_meets_the_body_of_the_hand(tmp_path):
    (tmp_path / "one.srdf").write_text(
        '<robot name="one"><disable_collisions link1="l4" link2="l6"/></robot>'
    )
    pairs = one_made(tmp_path, one_arm(NAMES, {})).model().description.self_pairs
    assert ("l3", "l6") in pairs
    assert ("l4", "l6") not in pairs
