"""The environment keeps its promises: Gymnasium's, determinism, limits, contacts, another robot."""

import os
import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import pytest
from collect_helpers import action, environment
from gymnasium.utils.env_checker import check_env

from handrail.collect.world.env import HandrailEnv
from handrail.collect.world.ideal_robot import IdealRobot
from handrail.collect.world.simulation import Simulation
from handrail.collect.world.tasks.reach import Reach
from handrail.controllers.errors import HandrailError

CAMERAS = ("wrist", "scene")


@pytest.mark.parametrize(
    ("name", "cameras"), [("Reach", ()), pytest.param("PickPlace", CAMERAS, marks=pytest.mark.needs_gl)]
)
def test_gymnasium_is_content(name, cameras):
    env = gymnasium.make(
        f"handrail/{name}-v0", cameras=cameras, image_size=(32, 32), disable_env_checker=True
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # actions are in m/s and rad/s, as the dataset stores them: no advice to normalise them is taken
        warnings.filterwarnings("ignore", message=".*recommend using a symmetric and normalized space")
        check_env(env.unwrapped, skip_render_check=not cameras)
    env.close()


def play(env, seed: int, steps: int = 25) -> bytes:
    rng = np.random.default_rng(seed)
    observation, _ = env.reset(seed=seed)
    record = [observation["agent_pos"].tobytes(), observation["environment_state"].tobytes()]
    for _ in range(steps):
        drive = rng.uniform(env.action_space.low, env.action_space.high).astype(np.float32)
        observation, reward, *ends, info = env.step(drive)
        record += [observation["agent_pos"].tobytes(), observation["environment_state"].tobytes()]
        record.append(repr((reward, ends, info, env.simulation.data.qpos.tobytes())).encode())
    return b"".join(record)


@pytest.mark.parametrize("name", ["Reach", "PickPlace"])
def test_the_same_seed_gives_the_same_bytes(name):
    with environment(name) as fresh, environment(name) as used:
        play(used, 3)
        play(used, 4, steps=7)
        assert play(fresh, 5) == play(used, 5)
        assert play(fresh, 5) != play(fresh, 6)


@pytest.mark.parametrize("plant", [IdealRobot, Simulation])
def test_a_checkpoint_is_of_its_own_episode_alone(plant):
    with environment("Reach", plant=plant) as env:
        env.reset(seed=1)
        then, drive = env.checkpoint(), np.full(env.model.size + 1, 0.2)
        first = env.step(drive)[0]
        env.restore(then)
        np.testing.assert_array_equal(env.step(drive)[0]["agent_pos"], first["agent_pos"])
        env.reset(seed=2)
        now = env.state()
        with pytest.raises(HandrailError, match=r"^environment Reach: .* this episode, .* before reset\(\)$"):
            env.restore(then)
        np.testing.assert_array_equal(env.state().q, now.q)


def test_a_number_that_is_not_finite_leaves_the_gripper_as_it_is():
    with environment("PickPlace") as env:
        env.reset(seed=1)
        wild = np.full(env.model.size + 1, np.nan)
        wild[-1] = 1.0
        assert env.step(wild)[-1]["sent"][-1] == 0.0


def test_what_touches_is_said_again_after_an_undo():
    with environment("Reach") as env:
        env.reset(seed=1)
        q = env.state().q.copy()
        q[4] += 1.2
        env.simulation.show(q)
        touching = env.step(action(env))[-1]["contacts"]
        then = env.checkpoint()
        assert touching
        assert env.restore(then)[1]["contacts"] == touching


@pytest.mark.needs_gl
def test_cameras_change_nothing():
    with environment() as blind, environment(cameras=CAMERAS, image_size=(16, 16)) as seeing:
        assert play(blind, 2, steps=10) == play(seeing, 2, steps=10)


@pytest.mark.parametrize("fps", [10, 30, 100])
def test_a_step_lasts_one_period(fps):
    with environment("Reach", fps=fps) as env:
        env.reset(seed=0)
        for index in range(1, 6):
            *_, info = env.step(action(env))
            assert info["time"] == pytest.approx(index / fps, abs=1e-9)
        assert env.simulation.mujoco_model.opt.timestep <= 0.002 + 1e-12


def test_the_episode_is_truncated_at_the_horizon():
    with environment("Reach", task=Reach(time_limit=0.15)) as env:
        env.reset(seed=0)
        ends = [env.step(action(env))[2:] for _ in range(3)]
    assert [truncated for _, truncated, _ in ends] == [False, False, True]
    assert ends[-1][2]["failure_reason"] == "timeout"
    assert not any(terminated for terminated, _, _ in ends)


def test_names_match_the_numbers():
    with environment() as env:
        observation, _ = env.reset(seed=0)
        assert len(env.agent_names) == 26 == observation["agent_pos"].size
        assert len(env.state_names) == observation["environment_state"].size
        numbers = dict(zip(env.agent_names, observation["agent_pos"], strict=True))
        assert numbers["gripper.opening"] == pytest.approx(1.0)
        np.testing.assert_allclose(
            [numbers[f"tool.{axis}"] for axis in "xyz"], env.task_state().tool.position, atol=1e-6
        )
        assert np.linalg.norm(observation["agent_pos"][-4:]) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"fps": 5}, "fps 5: expected 10 to 100 steps a second"),
        ({"cameras": ("left",)}, "unknown camera 'left': expected one of front, scene, wrist"),
        ({"render_mode": "human"}, "unknown render mode 'human': expected one of rgb_array"),
        ({"robot": "hal"}, "unknown robot 'hal'"),
    ],
)
def test_wrong_options_are_named(options, message):
    with pytest.raises(HandrailError, match=message):
        HandrailEnv("handrail.collect.world.tasks.reach:Reach", **options).reset(seed=0)


@pytest.mark.parametrize("wrong", ["nowhere:Foo", "reach", "math:Foo"])
def test_a_task_that_cannot_be_imported_is_one_line(wrong):
    with pytest.raises(HandrailError, match=f"task {wrong}: cannot import it: "):
        HandrailEnv(wrong)


@pytest.mark.parametrize("limit", [np.inf, np.nan, 0.0])
def test_a_task_that_would_never_end_or_begin_is_one_line(limit):
    with pytest.raises(HandrailError, match="time_limit of the task: expected"):
        HandrailEnv(Reach(time_limit=limit))
    HandrailEnv(Reach(time_limit=np.float32(3.0))).close()


@pytest.mark.parametrize("features", [np.zeros(4), np.zeros((1, 7)), [0.0, np.nan, *[0.0] * 5], [np.inf] * 7])
def test_features_that_are_not_as_many_finite_numbers_are_refused_in_one_line(monkeypatch, features):
    monkeypatch.setattr(Reach, "features", lambda task, state: features)
    with pytest.raises(HandrailError, match="task Reach: expected 7 finite numbers of features, got "):
        HandrailEnv(Reach(), plant=IdealRobot).reset(seed=0)


def test_before_reset_there_is_nothing_to_see():
    with environment("Reach") as env, pytest.raises(HandrailError, match=r"call reset\(\)"):
        env.state()


def test_unstable_physics_is_a_failure(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo writes MUJOCO_LOG.TXT where it runs
    with environment("Reach") as env:
        env.reset(seed=0)
        env.simulation.data.qvel[:] = np.nan
        *_, terminated, _, info = env.step(action(env))
        assert terminated
        assert info["failure_reason"] == "unstable"


def run(code: str, **environment_variables: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, **environment_variables},
        capture_output=True,
        text=True,
    )


def test_without_graphics_cameras_say_what_to_install_and_states_still_work():
    code = """
import gymnasium, handrail.collect
from handrail.controllers.errors import HandrailError
gymnasium.make("handrail/Reach-v0").reset(seed=0)
try:
    gymnasium.make("handrail/Reach-v0", cameras=("scene",)).reset(seed=0)
except HandrailError as error:
    print(error)
"""
    result = run(code, MUJOCO_GL="disable")
    assert result.returncode == 0, result.stderr
    assert "apt-get install libegl1 libgl1-mesa-dri" in result.stdout
    assert len(result.stdout.strip().splitlines()) == 1
