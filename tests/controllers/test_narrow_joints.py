"""Joints that cannot turn half around: which they are, when they are drawn to their middle, and what for."""

import numpy as np
from collect_helpers import episode

from handrail.collect.seeds import episode_seed
from handrail.controllers.interface.channels import Channels
from handrail.controllers.objectives.regularisation import narrow_joint_centring
from handrail.controllers.robot.model import load_model


def test_only_narrow_joints_and_only_while_just_the_whole_tool_is_steered():
    model = load_model("ridgeback_panda")
    channels = Channels.of(model.description)
    (centring,) = narrow_joint_centring(channels, model.description.limits, 10.0)
    narrow = np.isin(model.joints, ["panda_joint4", "panda_joint6"])
    np.testing.assert_array_equal(centring.weights(channels.mask("ee")), 10.0 * narrow)
    for names in (
        ("base",),
        ("base", "ee"),
        ("base.vx", "ee"),
        ("ee.vx", "ee.vy", "ee.vz", "ee.wz"),
        ("joint",),
        ("ee", "arm"),
        (),
    ):
        assert not centring.weights(channels.mask(*names)).any(), names


def test_a_hand_that_is_steered_to_a_far_pose_is_not_led_into_a_corner():
    """Left alone joints 2 and 6 end at their limits there, 0.4 m from the goal, and stay."""
    outcome = episode(episode_seed(100, 3), task="reach", robot="ridgeback_panda")
    assert outcome.success, outcome
    assert outcome.contact_onsets == 0
