"""What policies read and write: the same everywhere in the world, and nothing lost on the way."""

import dataclasses
import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from training_helpers import CHANNELS, JOINTS, POSE

from handrail.controllers.errors import HandrailError
from handrail.controllers.typed import decoded
from handrail.datasets.format.schema import Feature
from handrail.policies.imitation.interface.interface import PolicyInterface

STATE = (
    *(f"{joint}.pos" for joint in JOINTS),
    *(f"{joint}.vel" for joint in JOINTS),
    "gripper.opening",
    *(f"tool.{axis}" for axis in POSE),
)
ENVIRONMENT = (
    *(f"cube.{axis}" for axis in POSE),
    *(f"bin.{axis}" for axis in "xyz"),
    "inward.nx",
    "inward.ny",
    "drawer.opening",
    *(f"mover_0.{part}" for part in ("x", "y", "vx", "vy", "radius", "height")),
    *(f"obstacle_0.{part}" for part in ("x", "y", "radius", "height")),
    *(f"obstacle_1.{part}" for part in ("x", "y", "radius", "height")),
)
FEATURES = {
    "observation.state": Feature("float32", (len(STATE),), STATE),
    "observation.environment_state": Feature("float32", (len(ENVIRONMENT),), ENVIRONMENT),
    "teleop.values": Feature("float32", (CHANNELS.size + 1,), (*CHANNELS.names, "gripper")),
}


def read_interface(content):
    return decoded(content, PolicyInterface, "policy interface")


def made(seed, actions, *masks):
    """Return a made-up episode, and the interface of a policy that learns it."""
    columns = episode(np.random.default_rng(seed), masks or [("ee",)])
    return columns, PolicyInterface.of_dataset(FEATURES, [columns], actions)


def observed(interface, columns):
    return interface.observe(columns["observation.state"], columns["observation.environment_state"])


def episode(rng, masks, length=6):
    """A made-up episode; `obstacle_1` is not there."""
    state = rng.normal(size=(length, len(STATE)))
    environment = rng.normal(size=(length, len(ENVIRONMENT)))
    state[:, -4:] = Rotation.random(length, rng=rng).as_quat(scalar_first=True)
    environment[:, 3:7] = Rotation.random(length, rng=rng).as_quat(scalar_first=True)
    environment[:, -4:] = 0.0
    mask = np.array([np.append(CHANNELS.mask(*masks[i % len(masks)]), True) for i in range(length)])
    values = np.where(mask, rng.normal(size=mask.shape), 0.0)
    values[:, -1] = rng.integers(0, 2, length)
    return {
        "observation.state": state,
        "observation.environment_state": environment,
        "action": np.column_stack([rng.normal(size=(length, len(JOINTS))), values[:, -1]]),
        "teleop.values": values,
        "teleop.mask": mask,
    }


def moved(columns, shift, angle):
    """The same episode at another place of the world, turned by an angle."""
    turn = Rotation.from_euler("z", angle)
    flat = turn.as_matrix()[:2, :2]
    out = {key: np.array(column) for key, column in columns.items()}
    state, environment = out["observation.state"], out["observation.environment_state"]
    state[:, :2] = state[:, :2] @ flat.T + shift
    state[:, 2] += angle
    n = len(JOINTS)
    state[:, n : n + 2] = state[:, n : n + 2] @ flat.T
    for numbers, at in ((state, len(STATE) - 7), (environment, 0)):
        numbers[:, at : at + 2] = numbers[:, at : at + 2] @ flat.T + shift
        quaternion = Rotation.from_quat(numbers[:, at + 3 : at + 7], scalar_first=True)
        numbers[:, at + 3 : at + 7] = (turn * quaternion).as_quat(scalar_first=True)
    for at in (7, 13, 19):  # bin, mover_0, obstacle_0
        environment[:, at : at + 2] = environment[:, at : at + 2] @ flat.T + shift
    for at in (10, 15):  # inward, the velocity of mover_0
        environment[:, at : at + 2] = environment[:, at : at + 2] @ flat.T
    values, start = out["teleop.values"], CHANNELS.hand_slice().start
    for at in (start, start + 3, CHANNELS.joint_slice.start):
        values[:, at : at + 2] = values[:, at : at + 2] @ flat.T
    return out


@pytest.mark.parametrize("actions", ["realised", "intent"])
def test_same_everywhere(actions):
    """A policy sees and writes the same wherever in the world the same thing happens, but for where it is."""
    rng = np.random.default_rng(0)
    columns = episode(rng, [("ee",), ("base", "joint")])
    other = moved(columns, np.array([3.0, -2.0]), 2.1)
    interface = PolicyInterface.of_dataset(FEATURES, [columns], actions, base_pose=False)
    for here, there in zip(observed(interface, columns), observed(interface, other), strict=True):
        np.testing.assert_allclose(here, there, atol=1e-5)
    np.testing.assert_allclose(interface.encode(columns), interface.encode(other), atol=1e-5)


def test_a_policy_sees_where_the_base_is():
    """Its place and heading, after all else; who sees nothing of it sees the same otherwise."""
    columns, placed = made(2, "realised")
    without = dataclasses.replace(placed, base_pose=False)
    (state, around), (less, same) = observed(placed, columns), observed(without, columns)
    x, y, yaw = columns["observation.state"][:, :3].T
    names = placed.observation_names[0]
    assert names == (*without.observation_names[0], "base.x", "base.y", "base.cos", "base.sin")
    np.testing.assert_allclose(state[:, -4:], np.column_stack([x, y, np.cos(yaw), np.sin(yaw)]), atol=1e-6)
    np.testing.assert_array_equal(state[:, :-4], less)
    np.testing.assert_array_equal(around, same)


def test_an_older_checkpoint_keeps_its_view():
    """It does not say whether it sees where the base is, and velocities in the base's axes: it does not."""
    columns, interface = made(3, "intent")
    content = json.loads(json.dumps(dataclasses.asdict(interface)))
    assert read_interface(content) == interface
    del content["base_pose"], content["turned_velocities"]
    older = read_interface(content)
    assert older == dataclasses.replace(interface, base_pose=False, turned_velocities=False)
    (_, before), (_, around) = observed(older, columns), observed(interface, columns)
    names = interface.observation_names[1]
    start = names.index("mover_0.vx")
    recorded = columns["observation.environment_state"][:, ENVIRONMENT.index("mover_0.vx") :][:, :2]
    np.testing.assert_array_equal(before[:, start : start + 2], recorded.astype(np.float32))
    changed = (before != around).any(axis=0)
    assert [name for name, each in zip(names, changed, strict=True) if each] == ["mover_0.vx", "mover_0.vy"]
    with pytest.raises(HandrailError, match="base_pose: expected true or false"):
        read_interface(content | {"base_pose": "yes"})


def test_a_task_of_one_number_is_seen_too():
    """A column of one number is a list, without a second axis."""
    columns = episode(np.random.default_rng(3), [("ee",)])
    opening = columns["observation.environment_state"][:, ENVIRONMENT.index("drawer.opening")]
    columns["observation.environment_state"] = opening
    one = Feature("float32", (1,), ("drawer.opening",))
    features = FEATURES | {"observation.environment_state": one}
    interface = PolicyInterface.of_dataset(features, [columns], "realised")
    np.testing.assert_allclose(observed(interface, columns)[1][:, 0], opening, rtol=1e-6)


def test_a_policy_does_not_see_how_fast_the_robot_moves():
    columns, interface = made(1, "realised")
    faster, farther = (np.array(columns["observation.state"]) for _ in range(2))
    n = len(JOINTS)
    faster[:, n : 2 * n] *= 3.0
    farther[:, 5] += 0.1
    states = columns["observation.state"], faster, farther
    seen, same, other = (
        np.hstack(observed(interface, columns | {"observation.state": state})) for state in states
    )
    np.testing.assert_array_equal(seen, same)
    assert not np.array_equal(seen, other)


@pytest.mark.parametrize("masks", [[("ee",)], [("base",), ("ee",)], [("joint",)], [("ee.vx", "ee.wz")]])
def test_intent_comes_back(masks):
    """The intent that an action stands for is the one that was recorded."""
    columns, interface = made(1, "intent", *masks)
    for t, action in enumerate(interface.encode(columns)):
        intent = interface.decode(action, columns["observation.state"][t])
        np.testing.assert_allclose(intent.values, columns["teleop.values"][t, :-1], atol=1e-5)
        assert intent.mask.tolist() == columns["teleop.mask"][t, :-1].tolist()
        assert intent.grippers == (columns["teleop.values"][t, -1],)


def test_realised_is_the_next_velocity():
    columns, interface = made(2, "realised")
    state, n = columns["observation.state"], len(JOINTS)
    for t, action in enumerate(interface.encode(columns)[:-1]):
        intent = interface.decode(action, state[t])
        assert intent.mask.tolist() == CHANNELS.mask("joint").tolist()
        np.testing.assert_allclose(intent.values[CHANNELS.joint_slice], state[t + 1, n : 2 * n], atol=1e-5)


def test_at_the_goal_the_errors_vanish():
    columns = episode(np.random.default_rng(3), [("ee",)])
    columns["observation.environment_state"][:, :7] = columns["observation.state"][:, -7:]
    interface = PolicyInterface.of_dataset(FEATURES, [columns], "realised")
    _, around = observed(interface, columns)
    names = interface.observation_names[1]
    rotation = [name.startswith("cube.r") for name in names]
    offset = [name.startswith("cube.") and not name.startswith("cube.r") for name in names]
    np.testing.assert_allclose(around[:, offset], 0.0, atol=1e-5)
    np.testing.assert_allclose(around[:, rotation], np.tile(np.eye(3).ravel(), (len(around), 1)), atol=1e-6)


def test_absent_entries_stay_zero():
    columns, interface = made(4, "realised")
    _, around = observed(interface, columns)
    names = interface.observation_names[1]
    assert around.shape[1] == len(names)
    assert not around[:, [name.startswith("obstacle_1") for name in names]].any()


def test_wrong_inputs_are_named():
    columns = episode(np.random.default_rng(6), [("ee",)])
    only_state = {"observation.state": Feature("float32", (1,), ("a",))}
    with pytest.raises(HandrailError, match=r"observation\.environment_state"):
        PolicyInterface.of_dataset(only_state, [columns], "intent")
    idle = columns | {"teleop.mask": np.zeros_like(columns["teleop.mask"])}
    paused = PolicyInterface.of_dataset(FEATURES, [columns, idle], "intent")
    assert paused == PolicyInterface.of_dataset(FEATURES, [columns], "intent")  # a pause is no mask to learn
    with pytest.raises(HandrailError, match="steers"):
        PolicyInterface.of_dataset(FEATURES, [idle], "intent")
    with pytest.raises(HandrailError, match="policy interface"):
        read_interface({"actions": "realised"})
    lacking = dict(FEATURES)
    names = tuple("other" if name == "tool.x" else name for name in STATE)
    lacking["observation.state"] = dataclasses.replace(FEATURES["observation.state"], names=names)
    with pytest.raises(HandrailError, match=r"tool\.x"):
        observed(PolicyInterface.of_dataset(lacking, [columns], "realised"), columns)
