"""Policies of robots with two hands: each hand sees for itself, and what they write is each hand's own."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from handrail.collect.config import SessionConfig
from handrail.collect.world.observation import to_numbers
from handrail.controllers.interface.channels import Channels
from handrail.controllers.robot.description import load_description
from handrail.controllers.robot.model import load_model
from handrail.controllers.robot.shape import Obstacle, Shape
from handrail.datasets.format.schema import Feature
from handrail.policies.imitation.interface.checkpoint import MIXED, PolicyMeta, read_meta, write_meta
from handrail.policies.imitation.interface.interface import PolicyInterface
from handrail.policies.imitation.interface.origin import hand_of
from handrail.policies.imitation.interface.steps import CompletedRobot, Completion

TIAGO = load_description("tiago_pro")
CHANNELS, JOINTS, N = Channels.of(TIAGO), TIAGO.joints, len(TIAGO.joints)
POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")
HANDS = ("left", "right")
OWN = [(f"{hand}.gripper.opening", *(f"{hand}.tool.{part}" for part in POSE)) for hand in HANDS]
STATE = (*(f"{j}.pos" for j in JOINTS), *(f"{j}.vel" for j in JOINTS), *OWN[0], *OWN[1])
ENVIRONMENT = (*(f"goal.{part}" for part in POSE), "obstacle_0.x", "obstacle_0.y", "obstacle_0.radius")
FEATURES = {
    "observation.state": Feature("float32", (len(STATE),), STATE),
    "observation.environment_state": Feature("float32", (len(ENVIRONMENT),), ENVIRONMENT),
    "teleop.values": Feature("float32", (CHANNELS.size + 2,), (*CHANNELS.names, *CHANNELS.grippers)),
}


def episode(masks, length=5):
    rng = np.random.default_rng(0)
    state, around = rng.normal(size=(length, len(STATE))), rng.normal(size=(length, len(ENVIRONMENT)))
    turns = [state[:, 2 * N + 4 : 2 * N + 8], state[:, 2 * N + 12 :], around[:, 3:7]]
    for each in turns:
        each[:] = Rotation.random(length, rng=rng).as_quat(scalar_first=True)
    owned = [np.append(CHANNELS.mask(*masks[i % len(masks)]), [True, True]) for i in range(length)]
    values = np.where(owned, rng.normal(size=(length, CHANNELS.size + 2)), 0.0)
    values[:, -2:] = rng.integers(0, 2, (length, 2))
    action = np.column_stack([rng.normal(size=(length, N)), values[:, -2:]])
    return {
        "observation.state": state,
        "observation.environment_state": around,
        "action": action,
        "teleop.values": values,
        "teleop.mask": np.array(owned),
    }


def moved(columns, shift, angle):
    """The same episode at another place of the world, turned by an angle."""
    turn, out = Rotation.from_euler("z", angle), {key: np.array(each) for key, each in columns.items()}
    flat = turn.as_matrix()[:2, :2]
    state, around, values = (out[key] for key in list(FEATURES))
    state[:, 2] += angle
    twists = [CHANNELS.hand_slice(0).start, CHANNELS.hand_slice(1).start, CHANNELS.pair_slice.start]
    pairs = [(values, each + part) for each in twists for part in (0, 3)]
    for numbers, start in [*pairs, (values, CHANNELS.joint_slice.start), (state, N)]:
        numbers[:, start : start + 2] = numbers[:, start : start + 2] @ flat.T
    for numbers, start in [(state, 0), (state, 2 * N + 1), (state, 2 * N + 9), (around, 0), (around, 7)]:
        numbers[:, start : start + 2] = numbers[:, start : start + 2] @ flat.T + shift
    for numbers, start in [(state, 2 * N + 4), (state, 2 * N + 12), (around, 3)]:
        quaternion = Rotation.from_quat(numbers[:, start : start + 4], scalar_first=True)
        numbers[:, start : start + 4] = (turn * quaternion).as_quat(scalar_first=True)
    return out


def interface_of(columns, actions):
    return PolicyInterface.of_dataset(FEATURES, [columns], actions)


MASKS = [[("left",)], [("left", "right")], [("pair", "apart")], [("left",), ("right",)]]


@pytest.mark.parametrize("masks", MASKS)
@pytest.mark.parametrize("actions", ["intent", "realised"])
def test_a_motion_is_the_same_everywhere_and_nothing_is_lost(actions, masks):
    columns = episode(masks)
    interface = interface_of(columns, actions)
    elsewhere = moved(columns, np.array([1.5, -2.0]), 2.1)
    for one, other in zip(observed(interface, columns), observed(interface, elsewhere), strict=True):
        names = interface.observation_names[one.shape[1] != len(interface.observation_names[0])]
        kept = [i for i, name in enumerate(names) if not name.startswith("base.")]  # that says where it is
        np.testing.assert_allclose(one[:, kept], other[:, kept], atol=1e-5)
    written = interface.encode(columns)
    assert written.shape == (len(written), len(interface.action_names))
    np.testing.assert_allclose(written, interface.encode(elsewhere), atol=1e-5)
    assert interface.action_names[-2:] == ("left.gripper", "right.gripper")
    for row, state, values, owned in zip(
        written, *(columns[key] for key in ("observation.state", "teleop.values", "teleop.mask")), strict=True
    ):
        intent = interface.decode(row, state)
        assert intent.grippers == tuple(values[-2:])
        if actions == "intent":
            np.testing.assert_array_equal(intent.mask, owned[:-2])
            np.testing.assert_allclose(intent.values[intent.mask], values[:-2][intent.mask], atol=1e-5)


def observed(interface, columns):
    return interface.observe(columns["observation.state"], columns["observation.environment_state"])


def test_each_hand_sees_a_thing_from_where_it_is():
    """With a base that is not turned: the plain difference to the thing, by the hand's name."""
    columns = episode([("left",)])
    columns["observation.state"][:, :3] = 0.0
    interface = interface_of(columns, "intent")
    names = interface.observation_names
    seen = [
        dict(zip(each, rows.T, strict=True))
        for each, rows in zip(names, observed(interface, columns), strict=True)
    ]
    recorded = dict(zip(STATE, columns["observation.state"].T, strict=True))
    goal = columns["observation.environment_state"][:, 0]
    for hand in HANDS:
        tool = recorded[f"{hand}.tool.x"]
        np.testing.assert_allclose(seen[0][f"{hand}.tool.x"], tool, rtol=1e-5)
        np.testing.assert_allclose(seen[1][f"goal.{hand}.dx"], goal - tool, rtol=1e-4, atol=1e-5)
        assert f"{hand}.gripper.opening" in seen[0]
    assert "obstacle_0.x" in seen[1]  # from the base alone


def test_a_checkpoint_says_the_hand_and_of_one_hand_it_is_as_before(tmp_path):
    for hand in ("", "right", MIXED):
        origin = ("reach", "ee", "robot", 20, "realised", 0, 0, {}, "act", 1)
        write_meta(tmp_path, PolicyMeta(interface_of(episode([("left",)]), "realised"), *origin, hand=hand))
        assert read_meta(tmp_path).hand == hand
        assert ('"hand"' in (tmp_path / "handrail.json").read_text()) == bool(hand)


def test_intents_of_the_second_hand_are_completed_with_what_it_holds():
    """As LeRobot's evaluation runs them: the robot comes along, each gripper is the policy's."""
    model = load_model("bi_so101").with_hand("right")
    channels, n = Channels.of(model.description), model.size
    own = [(f"{hand}.gripper.opening", *(f"{hand}.tool.{part}" for part in POSE)) for hand in HANDS]
    names = (*(f"{j}.{kind}" for kind in ("pos", "vel") for j in model.joints), *own[0], *own[1])
    interface = PolicyInterface(
        "intent", names, (), channels.names, (tuple(channels.mask("right").tolist()),)
    )
    robot = CompletedRobot(interface, Completion("bi_so101", "reach", "ee", 20, "right"))
    state = np.concatenate([model.description.home, np.zeros(n), *[[1.0, 0, 0, 0, 1, 0, 0, 0]] * 2])
    held = Obstacle("cube", Shape("box", np.full(3, 0.02)), np.zeros(3), np.eye(3), frame="right.tool")
    around = to_numbers((held,), ("left.tool", "right.tool"))
    action = np.array([0.0, 0.0, 0.05, 0.0, 0.0, 0.0, 0.0, 1.0])
    velocities = robot.velocities(action, state, np.zeros(1), np.zeros(n), around)
    assert velocities.shape == (n + 2,)
    assert velocities[-2:].tolist() == [0.0, 1.0]
    right, left = (np.array(moves) for moves in model.description.moves[::-1])
    assert np.abs(velocities[:n][right]).max() > 1e-3
    assert np.abs(velocities[:n][left & ~right]).max() < np.abs(velocities[:n][right & ~left]).max()


def test_a_hand_that_was_not_said_is_the_first_one():
    """So that demonstrations with and without `--hand left` are of one hand."""
    said = [SessionConfig(robot="tiago_pro", hand=hand) for hand in ("", *HANDS)]
    assert [hand_of(config) for config in said] == ["left", *HANDS]
    assert hand_of(SessionConfig()) == hand_of(SessionConfig(robot="gone.toml")) == ""
