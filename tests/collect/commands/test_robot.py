"""`handrail-robot`: what it says, what it draws, and the page's commands for xArm7, Kinova and PR2."""

import re
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from command_helpers import command, ran, refused
from pages import commands

from handrail.collect.world.meshes import placed_meshes
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.robot.description import robot_names
from handrail.controllers.robot.model import load_model

XARM = "example-robot-data/robots/xarm_description/urdf/xarm7.urdf"


@pytest.fixture
def _here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.mark.slow
@pytest.mark.usefixtures("_here")
def test_the_page_s_commands_make_robots_that_reach():
    """Nothing is edited, nothing is wrong, and the goals are reached."""
    for name, *words in commands("handrail-", ["docs/own_robot.md"], "sh"):
        if name == "handrail-record":
            words[words.index("--dataset.num_episodes") + 1] = "3"
        done = command(*words, name=name.removeprefix("handrail-"))
        assert done.returncode == 0, done.stderr
        if name == "handrail-record":
            assert "3/3 succeeded" in done.stderr
            assert "contacts begun     0" in done.stderr
    assert {path.stem for path in Path().glob("*.toml")} == {"xarm7", "kinova", "pr2"}


@pytest.mark.slow
@pytest.mark.parametrize("robot", robot_names())
def test_nothing_is_wrong_with_a_robot_that_comes_along(robot):
    assert ran(robot, name="robot check") == f"{robot}: nothing is wrong\n"


def test_faults_end_with_1(tmp_path):
    path = tmp_path / "robot.toml"
    path.write_text(
        ROBOTS["lekiwi"]
        .file.read_text()
        .replace('"shoulder_lift", "elbow_flex"', '"elbow_flex", "shoulder_lift"')
    )
    done = command(path, name="robot check")
    assert done.returncode == 1
    assert done.stdout.startswith(
        "joints of robot lekiwi: expected the order x, y, theta, shoulder_pan, shoulder_lift"
    )
    assert done.stdout.count("\n") == 1


@pytest.mark.parametrize("part", ["hand.gripper", "camera"])
def test_a_frame_that_is_not_there_is_wrong_wherever_it_is_named(part, tmp_path):
    path, text = tmp_path / "robot.toml", ROBOTS["lekiwi"].file.read_text()
    before, mark, after = text.partition(f"[{part}]")
    path.write_text(before + mark + re.sub('frame = ".*"', 'frame = "nowhere"', after, count=1))
    done = command(path, name="robot check")
    assert (done.returncode, done.stdout.count("\n")) == (1, 1), done.stderr
    assert done.stdout.startswith("frame 'nowhere' of robot lekiwi: expected one of")


REFUSED = {
    "no hand": ((XARM,), "--hands: expected the link at the end of the hand, such as one of link_eef"),
    "another link": ((XARM, "--hands", "hand"), "--hands hand: expected a link of"),
    "two without names": ((XARM, "--hands", "link7,left=link_eef"), "expected NAME=LINK of each"),
    "two of one name": ((XARM, "--hands", "a=link7,a=link_eef"), "expected NAME=LINK of each"),
    "two on one link": ((XARM, "--hands", "a=link_eef,b=link_eef"), "a joint that moves no other hand"),
    "neither has a name": ((XARM, "--hands", "link7,link_eef"), "expected NAME=LINK of each"),
    "another joint": ((XARM, "--hands", "link_eef", "--joints", "neck"), "--joints neck: expected one of"),
    "no urdf": (("nothing.urdf", "--hands", "hand"), "URDF nothing.urdf: expected it beside"),
}


@pytest.mark.usefixtures("_here")
@pytest.mark.parametrize("case", REFUSED)
def test_impossible_settings_are_one_line_and_write_nothing(case):
    words, told = REFUSED[case]
    refused("new", *words, name="robot", told=told)
    assert not list(Path().iterdir())


@pytest.mark.usefixtures("_here")
def test_a_description_that_is_there_stays():
    Path("xarm7.toml").write_text("mine")
    refused("new", XARM, "--hands", "link_eef", name="robot", told="--overwrite")
    assert Path("xarm7.toml").read_text() == "mine"


@pytest.mark.needs_gl
def test_a_robot_is_drawn(tmp_path, monkeypatch):
    """In colours: its shapes are orange, over what it looks like."""
    picture = tmp_path / "robot.png"
    monkeypatch.setenv("HOME", str(tmp_path))
    ran("ridgeback_ur10", "--picture=~/robot.png", name="robot check")
    pixels = matplotlib.image.imread(picture)[..., :3]
    orange = (pixels[..., 0] > 0.6) & (pixels[..., 2] < 0.4)
    assert np.count_nonzero(orange) > 2000


DRAWN = """
name = "kinova"
base = { kind = "fixed", mass = 1.0, height = 0.1, size = [0.2, 0.2] }
home = { q = [0.0, 3.0, 3.0, 0.0, 3.0, 0.0] }
self_collision = { pairs = [] }
[[arm]]
urdf = "example-robot-data/robots/kinova_description/robots/kinova.urdf"
joints = [JOINTS]
[[hand]]
frame = "j2s6s200_end_effector"
[[collision]]
name = "hand"
frame = "j2s6s200_end_effector"
sphere = 0.1
[limits]
"""


def test_a_robot_of_dae_meshes_is_drawn_whole(tmp_path):
    """A mesh for every link that moves, as large as an arm's parts are."""
    limits = {
        "position_lower": -12.0,
        "position_upper": 12.0,
        "velocity": 1.0,
        "acceleration": 1.0,
        "effort": 9.0,
        "servo": 9.0,
    }
    joints = ", ".join(f'"j2s6s200_joint_{number}"' for number in range(1, 7))
    lines = "\n".join(f"{name} = {[value] * 6}" for name, value in limits.items())
    path = tmp_path / "kinova.toml"
    path.write_text(DRAWN.replace("JOINTS", joints) + lines)
    meshes = list(placed_meshes(load_model(path)))
    assert {mesh.joint for mesh in meshes} == set(range(7))
    sizes = [np.ptp(piece.vertices, axis=0).max() for mesh in meshes for piece in mesh.pieces]
    assert 0.05 < min(sizes) <= max(sizes) < 0.5
