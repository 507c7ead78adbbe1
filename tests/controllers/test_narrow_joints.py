"""Joints that cannot turn half around: which they are, when they are drawn to their middle, and what for."""

from dataclasses import replace

import numpy as np
from collect_helpers import episode
from ideal_robot import roll

from handrail.collect.seeds import episode_seed
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.objectives.ownership import leaves_freedom
from handrail.controllers.objectives.regularisation import narrow_joint_centring
from handrail.controllers.robot.model import RobotModel, load_model


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


def test_of_a_single_hand_joints_that_do_not_move_it_are_left_alone():
    """A head and an arm without a hand: nothing draws them to their middle, nor do they leave freedom."""
    two = load_model("bi_so101").description
    model = RobotModel(replace(two, hands=(replace(two.hands[0], name=""),)))
    channels, others = Channels.of(model.description), np.arange(model.size) >= 8
    (centring,) = narrow_joint_centring(channels, model.description.limits)
    assert not centring.weights(channels.mask("ee"))[others].any()
    assert not leaves_freedom(channels, channels.mask("base", *channels.names[12:17]))
    mpc, q = MaskedMpc(model, objectives=(centring,)), np.array(two.home)
    q[-2:] += 0.3  # the head's
    asks = [lambda time: Intent(np.zeros(channels.size), channels.mask("ee"), time=time)] * 40
    positions, _, _ = roll(mpc, asks, q)
    np.testing.assert_allclose(positions[-1][-2:], q[-2:], atol=0.01)


def test_a_hand_that_is_steered_to_a_far_pose_is_not_led_into_a_corner():
    """Left alone joints 2 and 6 end at their limits there, 0.4 m from the goal, and stay."""
    outcome = episode(episode_seed(100, 3), task="reach", robot="ridgeback_panda")
    assert outcome.success, outcome
    assert outcome.contact_onsets == 0
