"""An SO-101 leader and the arm of a LeKiwi are twins: no calibration of ours is needed."""

import numpy as np
import pytest

from handrail.collect.devices.calibration import same_arm
from handrail.collect.devices.follower import Follower
from handrail.collect.teleop_config import LeaderConfig
from handrail.controllers.robot.model import load_model


def test_the_arm_goes_as_many_degrees_as_its_leader():
    model = load_model("lekiwi")
    arm = model.description.arm_joints
    calibration = same_arm(LeaderConfig("so101_leader"), arm)
    follower, q = Follower(model, calibration), model.description.home
    leader = {f"{name}.pos": 10.0 * index for index, name in enumerate(arm)} | {"gripper.pos": 10.0}
    follower.targets(leader, True, q)
    turned = {name: value + 5.0 for name, value in leader.items()}
    assert np.array(follower.targets(turned, True, q)) - q[3:] == pytest.approx(np.radians([5.0] * 5))
    assert follower.grips(leader, False)
    assert not follower.grips({**leader, "gripper.pos": 90.0}, True)


@pytest.mark.parametrize(
    ("leader", "options", "robot"),
    [
        ("koch_leader", "", "lekiwi"),
        ("so101_leader", "use_degrees=false", "lekiwi"),
        ("so101_leader", "", "ridgeback_ur10"),
    ],
)
def test_any_other_pair_is_calibrated(leader, options, robot):
    assert same_arm(LeaderConfig(leader, options=options), load_model(robot).description.arm_joints) is None
