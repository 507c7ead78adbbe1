"""The meshes of a robot's file from whoever it is: those of its folder, or one line."""

import os
import re
import shutil

import numpy as np
import pytest

from handrail.collect.world.meshes import placed_meshes
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.robot.model import load_model

MESHES = {
    "/etc/passwd": "expected package://PATH, file in",
    "file:///etc/passwd": "expected package://PATH, file in",
    "arm.stl": "expected package://PATH, file in",
    "package://../arm.stl": "expected package://PATH, file in",
    "package://a/../../arm.stl": "expected package://PATH, file in",
    "package://out.stl": "expected package://PATH, file in",
    "package://none.stl": "No such file",
    "package://pipe.stl": "found a named pipe",
    "package://nan.stl": "expected finite coordinates",
    "package://inf.stl": "expected finite coordinates",
    "package://text.stl": "URDF",
}


@pytest.mark.parametrize("name", MESHES)
def test_a_mesh_elsewhere_or_of_no_numbers_is_one_line(name, tmp_path):
    """Law: no file outside the robot's folder is opened, wherever its URDF points."""
    (home := tmp_path / "home").mkdir()
    (home / "a").mkdir()
    for place, corner in ((tmp_path / "arm.stl", 1), (home / "nan.stl", np.nan), (home / "inf.stl", np.inf)):
        triangle = np.r_[np.zeros(3), 0, 0, 0, 1, 0, 0, 0, 1, corner].astype("<f4")
        place.write_bytes(bytes(80) + (1).to_bytes(4, "little") + triangle.tobytes() + bytes(2))
    (home / "out.stl").symlink_to(tmp_path / "arm.stl")
    (home / "text.stl").write_text("solid nothing")
    os.mkfifo(home / "pipe.stl")
    shutil.copy(ROBOTS.find("ridgeback_ur10").file, home / "robot.toml")
    text = load_model("ridgeback_ur10").description.arms[0].urdf.read_text()
    (home / "arm.urdf").write_text(re.sub('filename="package:[^"]*"', f'filename="{name}"', text))
    lines = (home / "robot.toml").read_text()
    (home / "robot.toml").write_text(re.sub("(?m)^urdf = .*", 'urdf = "arm.urdf"', lines))
    with pytest.raises(HandrailError, match=MESHES[name]):
        list(placed_meshes(load_model(home / "robot.toml")))
