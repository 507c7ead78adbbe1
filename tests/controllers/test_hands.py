"""Laws of a robot with two hands: each is steered, both are, as a pair; what nobody steers stays."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channel_matrix import channel_matrix
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.objectives.hold import end_effector_hold
from handrail.controllers.objectives.ownership import leaves_freedom, steered_joints
from handrail.controllers.objectives.together import TOGETHER, together, together_parameters
from handrail.controllers.objectives.tray import tray_levelling
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.robot.model import load_model

MODEL = load_model("tiago_pro")
CHANNELS = Channels.of(MODEL.description)
HOME = MODEL.description.home
LEFT, RIGHT = (np.array(each) for each in MODEL.description.moves)
AHEAD = [0.1, 0.0, 0.05, 0.0, 0.0, 0.1]


@pytest.fixture(scope="module")
def mpc():
    return MaskedMpc(MODEL)


class Driven:
    """An ideal robot under the MPC."""

    def __init__(self, mpc):
        self.mpc, self.state, self.commands = mpc, State(HOME.copy(), np.zeros(MODEL.size)), []
        mpc.reset()

    def steer(self, groups, values, seconds):
        mask = CHANNELS.mask(*groups)
        for _ in range(round(seconds / 0.05)):
            full = np.zeros(CHANNELS.size)
            full[mask] = values
            self.commands.append(self.mpc.update(self.state, Intent(full, mask, time=self.state.time)))
            v, then = self.state.v, self.commands[-1].velocity(0.05)
            self.state = State(self.state.q + 0.025 * (v + then), then, self.state.time + 0.05)
        return channel_matrix(MODEL, CHANNELS, self.state.q)[mask] @ self.state.v

    @property
    def brakes(self):
        return sum(command.diagnostics.status.brakes for command in self.commands)


def test_channels_are_named_after_the_hands():
    names = CHANNELS.names
    assert names[CHANNELS.hand_slice(0)][0] == "left.vx"
    assert names[CHANNELS.hand_slice(1)][-1] == "right.wz"
    assert names[CHANNELS.pair_slice] == (
        *(f"pair.{axis}" for axis in ("vx", "vy", "vz", "wx", "wy", "wz")),
        "apart.v",
    )
    assert names[CHANNELS.joint_slice][0] == "joint.x"
    assert CHANNELS.mask("ee").sum() == 12
    assert [names[i] for i in np.flatnonzero(CHANNELS.mask("left.arm"))] == [
        f"joint.arm_left_{number}_joint" for number in range(1, 8)
    ]
    assert Channels.named(names).names == names
    assert Channels.named(names).hand_slice(1) == CHANNELS.hand_slice(1)
    with pytest.raises(HandrailError, match="unknown channel 'middle'"):
        CHANNELS.mask("middle")


def test_each_joint_moves_the_hands_that_it_carries():
    for hand, moves in (("left", LEFT), ("right", RIGHT)):
        jacobian = MODEL.with_hand(hand).jacobian(HOME)
        np.testing.assert_array_equal(np.abs(jacobian).max(axis=0) > 1e-9, moves)
    with pytest.raises(HandrailError, match="unknown hand 'third'"):
        MODEL.with_hand("third")


@pytest.mark.parametrize("groups", [("left",), ("right",), ("left", "right"), ("pair",), ("pair", "apart")])
def test_commanded_channels_are_followed(mpc, groups):
    wanted = AHEAD * 2 if len(groups) == 2 and groups[1] == "right" else AHEAD
    wanted = [*wanted, 0.02] if "apart" in groups else wanted
    driven = Driven(mpc)
    done = driven.steer(groups, wanted, 2.0)
    np.testing.assert_allclose(done, wanted, atol=3e-3)
    assert driven.brakes == 0


def test_an_arm_that_nobody_steers_stays_where_it_was_let_go(mpc):
    driven = Driven(mpc)
    driven.steer(("right",), AHEAD, 2.0)
    driven.steer((), [], 0.5)
    before = driven.state.q
    driven.steer(("left",), AHEAD, 3.0)
    moved = np.abs(driven.state.q - before)
    assert np.all(moved[RIGHT & ~LEFT] < 0.03)
    assert np.any(moved[LEFT & ~RIGHT] > 0.1)
    assert np.abs(before - HOME)[RIGHT & ~LEFT].max() > 0.1  # that was not home


def test_joints_that_were_steered_stay_while_the_other_hand_is(mpc):
    driven = Driven(mpc)
    driven.steer(("left",), [0.0] * 6, 0.1)  # the right arm's place is known
    driven.steer(("right.arm",), [0.3, *[0.0] * 6], 1.5)
    driven.steer(("right.arm",), [0.0] * 7, 0.5)
    before = driven.state.q
    driven.steer(("left",), [0.0] * 6, 3.0)
    assert np.abs(driven.state.q - before)[RIGHT & ~LEFT].max() < 0.03
    assert np.abs(before - HOME)[RIGHT & ~LEFT].max() > 0.3


def test_a_pair_is_kept_as_it_begins_while_the_base_drives(mpc):
    driven = Driven(mpc)
    driven.steer(("right",), [0.0, 0.05, 0.05, 0.0, 0.0, 0.0], 1.0)
    before = together_parameters(MODEL, driven.state.q)
    driven.steer(("pair",), AHEAD, 2.0)
    driven.steer(("base", "pair"), [-0.05, 0.03, 0.05, *[0.0] * 6], 2.0)
    after = together_parameters(MODEL, driven.state.q)
    turn = Rotation.from_matrix(after[3:].reshape(3, 3) @ before[3:].reshape(3, 3).T)
    assert np.linalg.norm(after[:3] - before[:3]) < 5e-3
    assert np.degrees(turn.magnitude()) < 1.0
    assert driven.brakes == 0


@pytest.mark.parametrize(
    ("moved", "channel", "speed", "way"),
    [("left", "left.vy", 0.1, 0.08), ("joint.arm_left_2_joint", "joint.arm_left_2_joint", -0.3, 0.005)],
)
def test_a_pair_stays_as_its_hands_were_moved_beside_it(mpc, moved, channel, speed, way):
    driven, begun = Driven(mpc), together_parameters(MODEL, HOME)
    driven.steer(("pair",), [0.0] * 6, 0.5)
    names = np.array(CHANNELS.names)[CHANNELS.mask("pair", moved)]
    driven.steer(("pair", moved), np.where(names == channel, speed, 0.0), 3.0)
    before = together_parameters(MODEL, driven.state.q)
    driven.steer(("pair",), [0.0] * 6, 2.0)
    after = together_parameters(MODEL, driven.state.q)
    assert np.linalg.norm(before[:3] - begun[:3]) > way
    assert np.linalg.norm(after[:3] - before[:3]) < 0.25 * way


def test_the_plain_controller_keeps_a_pair(mpc):
    driven, before = Driven(mpc), together_parameters(MODEL, HOME)
    driven.steer(("pair",), [0.2, *[0.0] * 5], 4.0)
    after = together_parameters(MODEL, driven.state.q)
    turn = Rotation.from_matrix(after[3:].reshape(3, 3) @ before[3:].reshape(3, 3).T)
    assert np.linalg.norm(after[:3] - before[:3]) < 5e-3
    assert np.degrees(turn.magnitude()) < 1.0


def test_a_pair_is_kept_once_with_weights_of_ones_own():
    own = together(CHANNELS, position=1.0)
    objectives = MaskedMpc(MODEL, objectives=(own,)).residuals.objectives
    assert [each for each in objectives if each.name == TOGETHER] == [own]


def test_rows_take_their_own_arm_first():
    """Freedom is left while fewer rows are commanded than joints can answer them."""
    assert leaves_freedom(CHANNELS, CHANNELS.mask("left", "right"))
    assert leaves_freedom(
        CHANNELS, CHANNELS.mask("left.arm", "left", "base", "right")
    )  # the right arm has one more
    assert not leaves_freedom(CHANNELS, CHANNELS.mask("joint"))
    everything = CHANNELS.mask("base", "left", "right", "left.arm", "right.arm") | CHANNELS.mask(
        "joint.torso_lift_joint"
    )
    assert not leaves_freedom(CHANNELS, everything)
    np.testing.assert_array_equal(steered_joints(CHANNELS, CHANNELS.mask("left.vx")), LEFT)
    np.testing.assert_array_equal(steered_joints(CHANNELS, CHANNELS.mask("pair.vx")), LEFT | RIGHT)


def test_objectives_are_of_a_hand():
    hold, tray = (
        end_effector_hold(CHANNELS, hand=1),
        tray_levelling(CHANNELS, np.array([0.0, 0.0, 1.0]), hands=(1,)),
    )
    assert hold.name == "right.hold"
    assert hold.weights(CHANNELS.mask("left")).any()
    for objective in (hold, tray):
        assert not objective.weights(CHANNELS.mask("right")).any()
        assert not objective.weights(CHANNELS.mask("pair"))[:3].any()
    mpc = MaskedMpc(MODEL, objectives=(hold,))
    assert "right.hold" in mpc.residuals.names


def test_grippers_are_the_hands(mpc):
    driven = Driven(mpc)
    mask = CHANNELS.mask("left")
    for grippers, expected in (((1.0, 0.0), (1.0, 0.0)), ((0.5,), (0.5, 0.5)), ((2.0, -1.0), (1.0, 0.0))):
        intent = Intent(np.zeros(CHANNELS.size), mask, grippers, time=driven.state.time)
        assert driven.mpc.update(driven.state, intent).grippers == expected
        driven.state = State(HOME, np.zeros(MODEL.size), driven.state.time + 0.05)
    for wrong in ((0.0, 1.0, 0.0), (np.nan, 0.0)):
        intent = Intent(np.zeros(CHANNELS.size), mask, wrong, time=driven.state.time)
        command = driven.mpc.update(driven.state, intent)
        assert command.diagnostics.status.value == "invalid_intent"
        assert command.grippers == (1.0, 0.0)  # as before
        driven.state = State(HOME, np.zeros(MODEL.size), driven.state.time + 0.05)
    assert Intent(np.zeros(1), np.zeros(1, bool), (1.0,)).of_hands(2).grippers == (1.0, 1.0)
    assert not Intent(np.zeros(1), np.zeros(1, bool), (1.0, 0.0, 0.0)).of_hands(2).is_finite


TEXT = ROBOTS.find("tiago_pro").file.read_text()


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('name = "right"', 'name = "left"', "hand: name: expected each once, got 'left' twice"),
        ('name = "right"', 'name = ""', "a name such as left of each of several"),
        ('name = "right"', 'name = "pair"', "a name such as left of each of several"),
        ('name = "right"', 'name = "torso"', "a name such as left of each of several"),
        ('frame = "arm_right_tool_link"', 'frame = "arm_third_tool_link"', "arm_third_tool_link"),
        (
            'frame = "arm_right_tool_link"',
            'frame = "arm_left_tool_link"',
            "hand 'left' .* moves no other hand",
        ),
        ('frame = "arm_right_tool_link"', 'frame = "planar_base"', "hand 'right' .* moves no other hand"),
    ],
)
def test_hands_that_make_no_sense_are_refused(tmp_path, old, new, told):
    (tmp_path / "robot.toml").write_text(TEXT.replace(old, new))
    with pytest.raises(HandrailError, match=told):
        load_model(tmp_path / "robot.toml")


def test_two_arms_come_from_one_urdf():
    """Each with a prefix; the robot has the joints of both, and each hand is where its arm has it."""
    model = load_model("bi_so101")
    assert model.joints[3:5] == ("left_shoulder_pan", "left_shoulder_lift")
    assert model.size == 15
    q = model.description.home
    left, right = (model.pose(q, f"{hand}.tool").position for hand in ("left", "right"))
    np.testing.assert_allclose(left - right, [0.0, 0.17, 0.0], atol=1e-9)
    assert [sum(each) for each in model.description.moves] == [8, 8]
