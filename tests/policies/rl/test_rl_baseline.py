"""The baseline does what its environment and its network do; bad input brakes it, a bad file is refused."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from collect_helpers import write_small_robot
from rl_helpers import random_actor

from handrail.collect.config import SessionConfig
from handrail.collect.operators.modes import MODES
from handrail.collect.session.build import build_controller, build_mode
from handrail.collect.session.loop import Aiming
from handrail.collect.world.ideal_robot import IdealRobot
from handrail.collect.world.plant import Gate
from handrail.collect.world.scene import Scene
from handrail.collect.world.tasks.goal_reaching import STEP
from handrail.controllers.baselines.catalogue import CONTROLLERS
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Status
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.model import Pose, load_model
from handrail.policies.rl.controller import RlController
from handrail.policies.rl.observation import check_robot, conditioning
from handrail.policies.rl.policy import SHIPPED, Actor
from handrail.scripts.bench.rl.env import FINAL_SEED, GoalReachingEnv, evaluate, evaluation_goals

MODEL = load_model()
CHANNELS = Channels.of(MODEL.description)


def intent(twist, time: float = 0.0) -> Intent:
    values = np.zeros(CHANNELS.size)
    values[CHANNELS.hand_slice()] = twist
    return Intent(values, CHANNELS.mask("ee"), time=time)


@pytest.fixture
def controller():
    return RlController(MODEL, actor=random_actor())


def test_the_controller_moves_like_the_environment(controller):
    """Law: fed with the planner's twists, it commands the velocities that the actor was trained with."""
    env, actor = GoalReachingEnv(early_failure=False, physics=False), random_actor()
    home = MODEL.description.home
    for seed in (0, 1):
        observation, _ = env.reset(seed=seed)
        controller.reset()
        controller.aim(env.planner.goal)
        robot = IdealRobot(MODEL, Scene(), home, STEP, gate=Gate(MODEL, STEP, precision=np.float64))
        for t in range(80):
            command = controller.update(robot.state(), intent(env.planner.twist(t), t * STEP))
            observation, *_ = env.step(actor(observation))
            v = command.velocity(STEP)
            robot.send(np.append(v, 0.0))
            assert command.diagnostics.status is Status.OK
            assert np.allclose(v, env.velocity, atol=1e-5)
        assert np.abs(v[:3]).max() > 0.01


@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_spec_says_whether_its_controller_wants_the_goal(name):
    controller = build_controller(replace(MODES["ee"], controller=name), MODEL, 20.0)
    assert CONTROLLERS[name].aims == isinstance(controller, Aiming)


def test_as_many_joints_of_another_robot_are_refused():
    joints = ("x", "y", "theta", *(f"joint_{number}" for number in range(1, 7)))
    other = SimpleNamespace(joints=joints, description=SimpleNamespace(joints=joints, name="other"))
    assert CONTROLLERS["rl"].fits(MODEL.description)
    assert not CONTROLLERS["rl"].fits(other.description)
    with pytest.raises(HandrailError, match=r"robot other .*: expected the joints and arm of ridgeback_ur10"):
        check_robot(other)  # type: ignore[arg-type]


def test_another_arm_with_joints_of_the_same_names_is_refused(tmp_path):
    """A UR5 on a planar base moves otherwise; other limits or a robot's other name are no other arm."""
    small = load_model(write_small_robot(tmp_path))
    assert small.joints == MODEL.joints
    with pytest.raises(
        HandrailError, match=r"robot small_ur5 .*: expected the joints and arm of ridgeback_ur10"
    ):
        check_robot(small)
    said = "its controller cannot drive small_ur5: .* with ridgeback_ur10"
    with pytest.raises(HandrailError, match=said):
        build_mode(SessionConfig(robot=str(tmp_path / "small_ur5.toml"), mode="rl"), small)
    mine = replace(MODEL.description, name="mine", limits=small.description.limits)
    assert CONTROLLERS["rl"].fits(mine)


@pytest.mark.parametrize(
    ("spoil", "status"),
    [
        (lambda good: replace(good, values=np.full(CHANNELS.size, np.nan)), Status.INVALID_INTENT),
        (lambda good: replace(good, values=np.zeros(4)), Status.INVALID_INTENT),
        (lambda good: replace(good, mask=CHANNELS.mask("joint")), Status.INVALID_INTENT),
        (lambda good: replace(good, time=good.time - 1.0), Status.STALE_INTENT),
    ],
)
def test_bad_input_brakes_within_the_limits(controller, spoil, status):
    q, v = MODEL.description.home, np.zeros(9)
    for k in range(30):
        asked = intent([0.2, 0.0, 0.0, 0.0, 0.0, 0.0], k * STEP)
        v = controller.update(State(q, v, k * STEP), asked).velocity(STEP)
    speed = np.linalg.norm(v)
    for k in range(30, 130):
        before, time = v, k * STEP
        command = controller.update(State(q, v, time), spoil(intent(np.zeros(6), time)))
        v = command.velocity(STEP)
        assert command.diagnostics.status is status
        assert np.all(np.abs(v - before) <= MODEL.description.limits.acceleration * STEP + 1e-9)
        assert np.linalg.norm(v) < speed
    assert not command.velocities.any()


def test_a_new_episode_knows_nothing_of_the_one_before(controller):
    def drive():
        q, v = MODEL.description.home, np.zeros(9)
        for k in range(20):
            asked = intent([0.05, 0.1, 0.0, 0.0, 0.0, 0.2], k * STEP)
            v = controller.update(State(q, v, k * STEP), asked).velocity(STEP)
            q = q + STEP * v
        return q

    first = drive()
    controller.aim(Pose(np.array([0.5, 0.5, 0.8]), np.eye(3)))
    second = drive()
    controller.reset()
    assert not np.allclose(first, second)
    assert np.array_equal(first, drive())


def test_a_file_gives_the_same_actor_back(tmp_path):
    actor = random_actor()
    actor.save(tmp_path / "actor.npz")
    read = Actor.load(tmp_path / "actor.npz")
    observation = np.random.default_rng(1).normal(size=54)
    assert np.array_equal(read(observation), actor(observation))


def test_the_mean_of_actors_lies_between_them():
    """Law: in a single layer the mean's action before tanh is the mean of theirs."""
    rng = np.random.default_rng(3)
    pair = [Actor((rng.normal(size=(3, 54)),), (rng.normal(size=3),)) for _ in range(2)]
    observation = rng.normal(scale=0.1, size=54)
    expected = np.mean([np.arctanh(actor(observation)) for actor in pair], axis=0)
    assert np.allclose(np.arctanh(Actor.mean(pair)(observation)), expected, atol=1e-3)


@pytest.mark.parametrize("spoil", ["text", "missing", "cut", "nan", "pickle"])
def test_a_file_that_is_no_actor_is_refused(tmp_path, spoil):
    path, actor = tmp_path / "actor.npz", random_actor()
    weights, biases = list(actor.weights), list(actor.biases)
    arrays = {f"weight_{i}": value for i, value in enumerate(weights)}
    arrays |= {f"bias_{i}": value for i, value in enumerate(biases)}
    if spoil == "nan":
        arrays["bias_1"] = np.full(8, np.nan)
    elif spoil == "cut":
        arrays["weight_1"] = arrays["weight_1"][:, :-1]
    elif spoil == "pickle":
        arrays["bias_1"] = np.array([{}] * 8, dtype=object)
    if spoil == "text":
        path.write_text("an actor")
    elif spoil != "missing":
        np.savez(path, **arrays)
    with pytest.raises(HandrailError, match="actor"):
        Actor.load(path)


def test_plain_arrays_act_like_the_trained_network():
    """Law: the numpy forward pass is Stable-Baselines3's deterministic action."""
    sac = pytest.importorskip("stable_baselines3").SAC
    from handrail.scripts.bench.rl.train import actor_of

    env = GoalReachingEnv()
    P = conditioning()
    model = sac("MlpPolicy", env, policy_kwargs={"net_arch": [32, 16]}, buffer_size=10, seed=0, device="cpu")
    actor = actor_of(model)
    observation, _ = env.reset(seed=0)
    for _ in range(30):
        expected, _ = model.predict((P @ observation).astype(np.float32), deterministic=True)
        assert np.allclose(actor(observation), expected, atol=1e-5)
        observation, *_ = env.step(env.action_space.sample())


def test_the_record_is_the_actor_s():
    """Law: what the record says of goals reached is true of goals drawn in the same way."""
    record = json.loads((SHIPPED / "actor.json").read_text())
    said = record["final"]
    scores = evaluate(Actor.load(), evaluation_goals(20, FINAL_SEED), record["settings"]["physics"])
    assert said["success"]["mean"] >= 0.9
    assert sum(score["success"] for score in scores) >= 18
    lengths = [score["length"] for score in scores]
    assert said["length"]["min"] <= min(lengths)
    assert max(lengths) <= said["length"]["max"]
