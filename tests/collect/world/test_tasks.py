"""Tasks: what they sample, and how they judge."""

from dataclasses import replace

import numpy as np
import pytest
from collect_helpers import UP, action, environment, hold, moved, over_cube, reach

from handrail.collect.world.scene import Scene, SceneObject, box
from handrail.collect.world.task import Start
from handrail.collect.world.tasks import obstacles
from handrail.collect.world.tasks.furniture import footprint
from handrail.collect.world.tasks.pick_place import PickPlace
from handrail.collect.world.tasks.postures import near_home
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.description import robot_names
from handrail.controllers.robot.model import RobotModel, load_model

SEEDS = range(60)


def episodes(task) -> list[Start]:
    return [task.sample(load_model(), np.random.default_rng(seed)) for seed in SEEDS]


def test_pick_place_scenes_follow_their_description():
    chassis, sides, counts = np.hypot(*load_model().description.base.size) / 2, set(), set()
    for episode in episodes(PickPlace()):
        scene = episode.scene
        sides.add(np.sign(scene.find("cube").position[1]))
        cube, table, bin_table = (scene.find(name) for name in ("cube", "cube_table", "bin_table"))
        edge = table.position[0] - table.shape.size[0] / 2
        assert 0.10 <= cube.position[0] - edge <= 0.20
        assert cube.position[2] == pytest.approx(table.top + 0.025)
        assert 0.55 <= table.top <= 0.65
        assert abs(table.position[1] - bin_table.position[1]) > 2.5
        assert table.position[1] * bin_table.position[1] < 0
        bin_, size = scene.find("bin"), scene.find("bin").shape.size
        assert 0.24 <= size[0] - 0.02 <= 0.28
        assert np.all(
            np.abs(bin_.position[:2] - bin_table.position[:2]) < bin_table.shape.size[:2] / 2 - size[:2] / 2
        )
        assert bin_.position[2] - size[2] / 2 == pytest.approx(bin_table.top)
        obstacles = [item for item in scene.objects if item.name.startswith("obstacle")]
        counts.add(len(obstacles))
        for index, item in enumerate(obstacles):
            away = np.linalg.norm(item.position[:2] - episode.q[:2]) - chassis - footprint(item)
            assert away > 0.15
            assert 0.2 <= item.top <= 0.5
            for other in obstacles[:index]:
                gap = np.linalg.norm(item.position[:2] - other.position[:2])
                assert gap > footprint(item) + footprint(other)
    assert (sides, counts) == ({-1.0, 1.0}, {2, 3})


@pytest.mark.parametrize("robot", robot_names())
def test_pick_place_starts_in_contact_with_nothing_and_at_rest(robot):
    with environment(robot=robot) as env:
        for seed in range(8):
            env.reset(seed=seed)
            start = env.task_state().pose("cube").position
            for _ in range(5):
                *_, info = env.step(action(env))
                assert info["contacts"] == 0, info["contact_names"]
            state = env.task_state()
            assert np.linalg.norm(state.pose("cube").position - start) < 1e-3
            assert "cube" in state.still


def test_obstacles_for_the_controller_are_those_of_the_scene_and_enclose_them():
    with environment() as env:
        env.reset(seed=0)
        obstacles = {item.name: item for item in env.obstacles()}
        assert "cube" not in obstacles
        assert obstacles["bin"].work_surface
        assert obstacles["cube_table"].work_surface
        assert not obstacles["obstacle_0"].work_surface
        for name, obstacle in obstacles.items():
            pose = env.task_state().pose(name)
            np.testing.assert_allclose(obstacle.position, pose.position, atol=1e-9)
            if obstacle.shape.kind == "box":
                body = env.simulation.mujoco_model.body(name)
                for index in range(body.geomadr[0], body.geomadr[0] + body.geomnum[0]):
                    compiled = env.simulation.mujoco_model
                    size = np.abs(compiled.geom_pos[index]) + compiled.geom_size[index]
                    assert np.all(size <= obstacle.shape.size / 2 + 1e-9)
        with pytest.raises(HandrailError, match="unknown scene object 'cup': expected one of bin, "):
            env.task_state().pose("cup")
        with pytest.raises(HandrailError, match="unknown scene object 'cup'"):
            env.task_state().object("cup")


@pytest.mark.parametrize(
    ("where", "gripper", "success", "reason"),
    [
        ("bin", 0.0, True, ""),
        ("bin", 1.0, False, ""),
        ("beside", 0.0, False, ""),
        ("floor", 0.0, False, "dropped"),
    ],
)
def test_pick_place_is_judged_by_where_the_cube_rests(where, gripper, success, reason):
    with environment() as env:
        env.reset(seed=1)
        scene = env.start.scene
        bin_ = scene.find("bin")
        places = {
            "bin": bin_.position + np.array([-0.05, 0.03, 0.3]),
            "beside": [bin_.position[0] + 0.25, bin_.position[1], scene.find("bin_table").top + 0.03],
            "floor": [-0.8, 0.9, 0.03],
        }
        env.reset(options={"start": moved(env.start, "cube", places[where])})
        for _ in range(40):
            *_, terminated, _, info = env.step(action(env, gripper=gripper))
            assert not (info["is_success"] and "cube" not in env.task_state().still)  # it flew through
            if terminated:
                break
        assert info["is_success"] == success
        assert info["failure_reason"] == reason
        assert terminated == (success or bool(reason))


def test_no_success_while_the_gripper_is_at_the_cube():
    with environment() as env:
        env.reset(seed=1)
        episode = moved(env.start, "cube", env.start.scene.find("bin").position - [0.0, 0.0, 0.015])
        env.reset(options={"start": episode})
        cube = env.task_state().pose("cube").position
        q = np.array([cube[0] - 1.05, cube[1], 0.0, 1.57, -1.2, 1.8, -2.2, -1.57, 0.0])
        for height, success in ((0.05, False), (0.12, True)):
            near = reach(env.model, q, cube + height * UP, np.diag([1.0, -1.0, -1.0]))
            env.reset(options={"start": Start(episode.scene, near)})
            assert hold(env, 20)["is_success"] == success


def test_a_grasped_cube_stays_through_lifting_driving_and_turning():
    """Closure: 1 m/s² of the base, 1 rad/s at the wrist, ten seconds of holding; slip below 2 mm."""
    with environment() as env:
        env.reset(options={"start": over_cube(env, 1, 0.005)})

        def slip() -> np.ndarray:
            state = env.task_state()
            return state.tool.rotation.T @ (state.pose("cube").position - state.tool.position)

        def drive(steps: int, velocity, gripper: float = 1.0) -> None:
            for _ in range(steps):
                *_, info = env.step(action(env, velocity, gripper))
                assert info["contacts"] == 0, info["contact_names"]

        drive(25, 0.0)
        held = slip()
        assert 0.4 < env.simulation.openings[0] < 0.7
        for _ in range(40):
            J = env.model.jacobian(env.state().q)[:, 3:]
            lift = np.linalg.lstsq(J, np.array([0, 0, 0.1, 0, 0, 0.0]), rcond=None)[0]
            drive(1, np.concatenate([np.zeros(3), lift]))
        drive(20, [-1.0] + [0.0] * 8)  # the limiter makes this ±1 m/s²
        drive(30, 0.0)
        drive(20, [0.0] * 8 + [1.0])
        drive(200, 0.0)
        assert env.task_state().pose("cube").position[2] > env.task_state().object("cube").position[2] + 0.15
        assert np.linalg.norm(slip() - held) < 0.002
        hold(env, 40)
        assert env.task_state().pose("cube").position[2] < 0.7  # open fingers let go


def test_a_scene_refuses_two_things_of_one_name():
    thing = SceneObject("thing", box([0.1] * 3), np.zeros(3))
    with pytest.raises(HandrailError, match="objects in a scene: expected each once, got 'thing' twice"):
        Scene((thing, thing))


def test_no_room_for_obstacles_is_an_error(monkeypatch):
    monkeypatch.setattr(obstacles, "CLEARANCE", 3.0)
    with pytest.raises(HandrailError, match="no room for"):
        PickPlace().sample(load_model(), np.random.default_rng(0))


def test_no_episode_begins_beyond_a_limit():
    """Also of a robot whose home is at one."""
    model = load_model()
    upper = model.description.limits.position_upper
    home = np.where(np.arange(model.size) > 4, upper, model.description.home)
    at_one = RobotModel(replace(model.description, home=home))
    for seed in range(20):
        assert (near_home(at_one, np.random.default_rng(seed)) <= upper).all()
