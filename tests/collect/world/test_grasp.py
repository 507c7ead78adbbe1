"""What the fingers hold, and that the loop tells the controller of it."""

from contextlib import closing

import numpy as np
import pytest
from collect_helpers import action, environment, episode, hold, over_cube

from handrail.collect.config import SessionConfig
from handrail.collect.operators.scripted.pick_place import tips_beyond_tool
from handrail.collect.session.build import (
    build_controller,
    build_env,
    build_mode,
    build_operator,
)
from handrail.collect.session.session import Session
from handrail.collect.world.task import Start
from handrail.controllers.robot.model import load_model

MODEL = load_model()


def test_the_fingers_hold_what_both_of_them_touch():
    with environment("PickPlace") as env:
        env.reset(options={"start": over_cube(env, 3, 0.01)})
        assert env.simulation.held() == ()
        hold(env, 20, gripper=1.0)
        (cube,) = env.simulation.held()
        assert cube.name == "cube"
        assert [each.name for each in env.obstacles() if each.held] == ["cube"]
        assert np.linalg.norm(cube.position) < 0.03
        now, tool = env.task_state().pose("cube"), env.task_state().tool
        np.testing.assert_allclose(tool.position + tool.rotation @ cube.position, now.position, atol=1e-9)
        np.testing.assert_allclose(tool.rotation @ cube.rotation, now.rotation, atol=1e-9)
        hold(env, 20)
        assert env.simulation.held() == ()


def test_fingers_that_rest_on_a_thing_do_not_hold_it():
    with environment("PickPlace") as env:
        start = over_cube(env, 3, 0.045)  # the finger tips 5 mm above the cube
        env.reset(options={"start": Start(start.scene, start.q, grip=(0.0,))})
        touched = False
        for _ in range(30):
            down = np.linalg.pinv(env.model.jacobian(env.state().q)) @ [0.0, 0.0, -0.01, 0.0, 0.0, 0.0]
            env.step(action(env, down, gripper=1.0))
            names = {
                env.simulation.mujoco_model.geom(int(geom)).name
                for geom in env.simulation.data.contact.geom.ravel()
            }
            touched = touched or {"cube", "finger_left", "finger_right"} <= names
            assert env.simulation.held() == ()
        assert touched


def test_a_held_tray_is_the_box_around_its_parts():
    with environment("Tray") as env:
        env.reset(seed=2)
        hold(env, 3, gripper=1.0)
        (tray,) = env.simulation.held()
        item, now, tool = env.start.scene.find("tray"), env.task_state().pose("tray"), env.task_state().tool
        corners = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1).T * tray.shape.size
        box = tool.position + (tray.position + corners @ tray.rotation.T) @ tool.rotation.T
        local = (box - now.position) @ now.rotation
        for part in item.parts:
            half = np.array(part.shape.size) / 2
            assert np.all(part.position - half > local.min(axis=0) - 1e-9)
            assert np.all(part.position + half < local.max(axis=0) + 1e-9)
        np.testing.assert_allclose(np.ptp(local, axis=0), [0.26, 0.32, 0.225], atol=1e-9)


class Watch:
    """Notes what a controller is told."""

    def __init__(self, inner):
        self.inner, self.told = inner, []

    def reset(self, obstacles=()):
        self.told.clear()
        self.inner.reset(obstacles)

    def update_scene(self, obstacles):
        self.told.append(tuple(obstacle.name for obstacle in obstacles if obstacle.held))
        self.inner.update_scene(obstacles)

    def update(self, state, intent):
        return self.inner.update(state, intent)


def test_a_session_tells_the_controller_what_is_held_until_it_is_let_go():
    config = SessionConfig(task="tray", mode="ee", noise=0.0)
    with closing(build_env(config, 20)) as env:
        mode = build_mode(config, env.model)
        watch = Watch(build_controller(mode, env.model, 20, "tray"))
        outcome = Session(env, watch, build_operator(config, mode, env.model)).run(seed=1)
    assert outcome.success
    assert outcome.contact_onsets == 0
    assert watch.told[0] == ("tray",)
    assert watch.told[-1] == ()  # told once that nothing is held any more
    assert watch.told.count(()) < 5  # the fingers may lose it for a moment while they open
    assert len(watch.told) > 0.7 * outcome.frames


class Closing:
    """Notes where the cube is from the tool when the gripper begins to close, an observer."""

    def begin(self, env, seed):
        self.env, self.offsets, self.masks = env, [], set()
        self.closing = False

    def see(self, frame):
        state, closing = self.env.task_state(), frame.action[-1] > 0.5
        self.masks.add(frame.intent.mask.tobytes())
        if closing and not self.closing:
            cube = state.pose("cube")
            self.offsets.append(state.tool.rotation.T @ (cube.position - state.tool.position))
        self.closing = closing


@pytest.mark.parametrize(
    ("robot", "mode"),
    [("ridgeback_ur10", "switching"), ("ridgeback_ur10", "direct"), ("ridgeback_panda", "ee")],
)
def test_the_operator_closes_the_gripper_around_the_cube(robot, mode):
    """The cube is between the fingers, with what the hand may be turned; their tips are beside it."""
    model, edge, watch = load_model(robot), 0.05, Closing()
    gripper = model.description.hands[0].gripper
    outcome = episode(100, watch, task="pick_place", mode=mode, robot=robot)
    assert outcome.success
    if mode != "direct":
        assert (outcome.contact_onsets, outcome.brakes) == (0, 0)
        assert outcome.smallest_distance >= 0.05
    assert len(watch.masks) == (2 if mode == "switching" else 1)
    tips = {"ridgeback_ur10": 0.015, "ridgeback_panda": 0.0095}[robot]  # beyond the tool point
    assert tips_beyond_tool(model) == pytest.approx(tips)
    for across, _, along in watch.offsets:
        assert abs(across) < (gripper.stroke - edge) / 2
        assert tips - edge / 2 < along < tips + 0.01
