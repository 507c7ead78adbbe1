"""A robot's file from whoever it is: a robot, or one line; whatever is put into it, deep down or between."""

import os
import re
import shutil
import signal
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from command_helpers import refused
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from toml_helpers import mutated, spoilt

from handrail.collect.world.scene import Scene, SceneObject, box
from handrail.collect.world.stage import add_scene, new_stage
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.robot.description import load_description, robot_names
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.strict_toml import read_toml

TEXTS = {name: spec.file.read_text() for name, spec in ROBOTS.items()}
QUICK = settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture])


def one_line_or_a_robot(path) -> None:
    """The line is one: conftest.py looks at every error."""
    with suppress(HandrailError):
        model = RobotModel(load_description(path))
        CollisionModel(model, ())
        model.pose(model.description.home)


@pytest.mark.parametrize("robot", robot_names())
@given(data=st.data())
@QUICK
def test_an_entry_of_another_kind_is_one_line(robot, tmp_path, data):
    path = tmp_path / "robot.toml"
    path.write_text(mutated(TEXTS[robot], data))
    one_line_or_a_robot(path)


@given(data=st.data())
@QUICK
def test_another_text_is_one_line(tmp_path, data):
    path = tmp_path / "robot.toml"
    path.write_bytes(spoilt(TEXTS["ridgeback_ur10"], data, 40))
    one_line_or_a_robot(path)


@pytest.mark.parametrize(
    "content",
    [
        *(b"\xff\xfe", b"", b"a = " + b"[" * 100_000, b"a = " + b"9" * 10_000, b"a=1\n" * 2, b"#" * 2**21),
        TEXTS["ridgeback_ur10"].replace("mass = 165.3", "mass = 0x" + "f" * 10_000).encode(),
    ],
    ids=["bytes", "empty", "deep", "digits", "twice", "large", "hexadecimal"],
)
def test_a_file_that_is_no_description_is_one_line(content, tmp_path):
    path = tmp_path / "robot.toml"
    path.write_bytes(content)
    with pytest.raises(HandrailError, match="robot description"):
        load_description(path)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("floor", "collision: expected each once, got 'floor' twice"),
        ("finger_left", "repeated name 'finger_left'"),
        ("cube", "robot ridgeback_ur10: expected no shape or joint called as the task's 'cube'; rename it"),
    ],
)
def test_a_shape_with_a_name_that_is_taken_is_one_line(name, words, tmp_path):
    """By the floor, by a finger of the gripper, by what stands in the scene."""
    path = tmp_path / "robot.toml"
    shape = f'[[collision]]\nname = "{name}"\nframe = "planar_base"\nsphere = 0.1\n\n[[visual]]'
    path.write_text(TEXTS["ridgeback_ur10"].replace("[[visual]]", shape, 1))
    assert words in refused("--robot", path, "--task", "pick_place", "--dataset.root", tmp_path / "set")
    assert not (tmp_path / "set").exists()


def test_a_hand_stands_on_a_link_not_on_a_joint(tmp_path):
    """No joint of the arm would count as moving it."""
    path = tmp_path / "robot.toml"
    path.write_text(re.sub(r'frame = ".*"', 'frame = "wrist_3_joint"', TEXTS["ridgeback_ur10"], count=1))
    with pytest.raises(HandrailError, match="tool frame 'wrist_3_joint' of robot ridgeback_ur10: no link"):
        RobotModel(load_description(path))


def test_a_thing_of_a_task_that_is_wrong_is_not_blamed_on_the_robot():
    thing, spec = SceneObject("mug", box((0.1, 0.1, 0.1)), np.array([1.0, 2.0])), new_stage(False)
    with pytest.raises(HandrailError, match=r"\Athe task's 'mug': pos should be "):
        add_scene(spec, Scene((thing,)))
    for name in "floor", "world":
        with pytest.raises(HandrailError, match=rf"\Athe task's '{name}': .*repeated name"):
            add_scene(new_stage(False), Scene((SceneObject(name, box((0.1, 0.1, 0.1)), np.zeros(3)),)))


def beside(folder: Path, urdf: str) -> Path:
    path = folder / "robot.toml"
    text = TEXTS["ridgeback_ur10"]
    path.write_text(text.replace("example-robot-data/robots/ur_description/urdf/ur10_robot.urdf", urdf))
    return path


def test_a_urdf_lies_beside_the_description_and_is_one(tmp_path):
    own = load_description("ridgeback_ur10").arms[0].urdf
    (home := tmp_path / "home").mkdir()
    path = beside(home, "arm.urdf")
    shutil.copy(own, home / "arm.urdf")
    assert RobotModel(load_description(path)).size == 9
    shutil.move(home / "arm.urdf", tmp_path / "arm.urdf")
    (home / "arm.urdf").symlink_to(tmp_path / "arm.urdf")
    with pytest.raises(HandrailError, match="expected a path inside a package, or beside"):
        load_description(path)


@pytest.mark.parametrize("urdf", [".", "./", "..", "/etc/passwd", "a/../../b.urdf"])
def test_a_urdf_elsewhere_is_one_line(urdf, tmp_path):
    with pytest.raises(HandrailError, match="expected a path inside a package, or beside"):
        load_description(beside(tmp_path, urdf))


def chain(links: int) -> str:
    """Return a URDF of links in a row."""
    joints = (
        f"<joint name='j{i}' type='fixed'><parent link='l{i}'/><child link='l{i + 1}'/></joint>"
        for i in range(links - 1)
    )
    return f"<robot name='x'>{''.join(f"<link name='l{i}'/>" for i in range(links))}{''.join(joints)}</robot>"


LINK = "<robot name='x'><link name='a'/>"
URDFS = {
    text: (text, "arm.urdf|URDF") for text in ("", "<robot", f"{LINK}<link name='a'/></robot>", "no")
} | {
    "chain": (chain(20_000), "expected at most 1000 elements 'link', got 20000"),
    "entity": ("<!DOCTYPE robot [<!ENTITY a 'b'>]><robot name='&a;'/>", "no DOCTYPE"),
    "large": (" " * (16 * 2**20 + 1), "expected at most 16 MB"),
    "tiny": (f"{LINK}<limit velocity='5e-324'/></robot>", "got '5e-324'"),
    "nan": (f"{LINK}<limit velocity='nan'/></robot>", "got 'nan'"),
    "huge": (f"{LINK}<limit velocity='-1e300'/></robot>", "got '-1e300'"),
}


@pytest.mark.parametrize("case", URDFS)
def test_a_urdf_that_is_none_or_that_pinocchio_cannot_stand_is_one_line(case, tmp_path):
    """Twenty thousand links overflow its stack, and end the process."""
    content, said = URDFS[case]
    (tmp_path / "arm.urdf").write_text(content)
    with pytest.raises(HandrailError, match=said):
        RobotModel(load_description(beside(tmp_path, "arm.urdf")))


@pytest.fixture
def hangs():
    """Opening a named pipe waits for ever: that fails."""
    before = signal.signal(signal.SIGALRM, lambda *_: pytest.fail("it hangs"))
    signal.alarm(60)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.usefixtures("hangs")
def test_a_named_pipe_is_one_line(tmp_path):
    os.mkfifo(tmp_path / "robot.toml")
    with pytest.raises(HandrailError, match=r"robot description .*found a named pipe"):
        read_toml(tmp_path / "robot.toml", "robot description")
    (home := tmp_path / "home").mkdir()
    os.mkfifo(home / "arm.urdf")
    with pytest.raises(HandrailError, match=r"URDF arm\.urdf: expected it beside"):
        load_description(beside(home, "arm.urdf"))
