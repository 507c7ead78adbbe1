"""A robot's cameras are where its description says, and what they look at can be seen."""

import numpy as np
import pytest

from handrail.collect.config import SessionConfig
from handrail.collect.session.build import build_env
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.robot.description import load_description, robot_names

UR10 = ROBOTS["ridgeback_ur10"].file.read_text()


@pytest.mark.parametrize("robot", robot_names())
def test_a_camera_looks_where_the_description_says_wherever_the_robot_is(robot):
    env, rng = build_env(SessionConfig(task="reach", robot=robot), 20), np.random.default_rng(3)
    env.reset(seed=0)
    model, limits, simulation = env.model, env.model.description.limits, env.simulation
    for _ in range(5):
        q = rng.uniform(np.maximum(limits.position_lower, -3), np.minimum(limits.position_upper, 3))
        simulation.show(q)
        for camera in model.description.cameras:
            pose, seen = model.pose(q, camera.frame), simulation.data.camera(camera.name)
            position = pose.position + pose.rotation @ camera.position
            target = pose.position + pose.rotation @ camera.looks_at
            ahead = (target - position) / np.linalg.norm(target - position)
            np.testing.assert_allclose(seen.xpos, position, atol=1e-9)
            np.testing.assert_allclose(-seen.xmat.reshape(3, 3)[:, 2], ahead, atol=1e-9)


@pytest.mark.parametrize("robot", robot_names())
def test_horizons_are_level_at_home(robot):
    env = build_env(SessionConfig(task="reach", robot=robot), 20)
    env.reset(seed=0)
    env.simulation.show(np.array(env.model.description.home))
    for camera in env.model.description.cameras:
        axes = env.simulation.data.camera(camera.name).xmat.reshape(3, 3)
        assert abs(axes[2, 0]) < 0.06, camera.name  # right of the picture, against the world's up
        assert axes[2, 1] > 0, camera.name


@pytest.mark.needs_gl
@pytest.mark.parametrize(
    ("robot", "share"), [("ridgeback_ur10", 1.0), ("ridgeback_panda", 1.0), ("lekiwi", 0.7)]
)
def test_the_goal_is_in_the_pictures_of_first_frames(robot, share):
    """The marker's colours are there, and others than without it."""
    env = build_env(SessionConfig(task="reach", robot=robot, cameras="front", image_size=128), 20)
    found = 0
    for seed in range(20):
        picture = env.reset(seed=seed)[0]["pixels"]["front"].astype(int)
        model = env.simulation.mujoco_model
        body = model.body("goal").id
        model.geom_rgba[model.geom_bodyid == body, 3] = 0.0
        without = env.restore(env.checkpoint())[0]["pixels"]["front"]
        found += (np.abs(picture - without).max(axis=2) > 40).sum() >= 9
    env.close()
    assert found >= share * 20


@pytest.mark.needs_gl
def test_pictures_may_be_wider_than_high():
    env = build_env(SessionConfig(task="reach", cameras="front", image_size="64x32"), 20)
    picture = env.reset(seed=0)[0]["pixels"]["front"]
    assert picture.shape == (32, 64, 3)
    assert env.observation_space.contains(env.step(env.action_space.sample())[0])
    env.close()


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ('name = "wrist"', 'name = "front"', "camera: expected each once, got 'front' twice"),
        ('name = "wrist"', 'name = "scene"', "camera: expected each once, got 'scene' twice"),
        (
            "looks_at = [0.0, 0.0, 0.374]",
            "looks_at = [0.0, -0.10, 0.10]",
            "camera wrist: expected looks_at away",
        ),
        ("up = [0.966, 0.258, 0.0]", "up = [0.0, 0.10, 0.274]", "camera wrist: .* up aside from there"),
        ("fovy = 85.0", "fovy = 185.0", "camera.*fovy"),
    ],
)
def test_a_camera_without_sense_is_one_line(before, after, words, tmp_path):
    path = tmp_path / "robot.toml"
    assert before in UR10
    path.write_text(UR10.replace(before, after))
    with pytest.raises(HandrailError, match=words):
        load_description(path)
