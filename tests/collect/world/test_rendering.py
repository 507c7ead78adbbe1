"""A picture depends on what is drawn, not on what was drawn before."""

from contextlib import closing

import numpy as np
import pytest

from handrail.collect.config import SessionConfig
from handrail.collect.session.build import build_env
from handrail.collect.world import rendering
from handrail.collect.world.env import HandrailEnv
from handrail.collect.world.gl import mujoco
from handrail.collect.world.rendering import Painter
from handrail.collect.world.scene import Scene, SceneObject
from handrail.collect.world.simulation import Simulation
from handrail.collect.world.task import FixedTask, Start, Verdict
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import load_model
from handrail.controllers.robot.shape import Shape


@pytest.fixture(scope="module")
def simulations():
    """Simulations of two episodes each of two tasks."""
    found = []
    for task in ("reach", "pick_place"):
        env = build_env(SessionConfig(task=task, cameras="wrist"), 20)
        for seed in (1, 2):
            env.reset(seed=seed)
            found.append(env.simulation)
        env.close()
    return found


@pytest.mark.needs_gl
@pytest.mark.parametrize("pretty", [False, True])
def test_one_painter_draws_what_a_new_one_draws(simulations, pretty):
    kept, size = Painter((48, 64), pretty), (48, 64)
    for simulation in (*simulations, simulations[0]):
        new = Painter(size, pretty)
        for camera in ("wrist", "front", "scene"):
            pictures = [
                painter.paint(simulation.mujoco_model, simulation.data, camera) for painter in (kept, new)
            ]
            assert np.array_equal(*pictures)
            assert pictures[0].shape == (*size, 3)
            assert np.ptp(pictures[0]) > 50
        new.close()
    one, other = (kept.paint(each.mujoco_model, each.data, "scene") for each in simulations[:2])
    assert not np.array_equal(one, other)  # two episodes
    with pytest.raises(HandrailError, match="unknown camera 'roof': expected one of"):
        kept.paint(simulations[0].mujoco_model, simulations[0].data, "roof")
    kept.close()
    kept.close()


@pytest.mark.needs_gl
@pytest.mark.parametrize("robot", ["ridgeback_ur10", "ridgeback_panda", "lekiwi"])
def test_bands_that_are_spared_cannot_be_seen(robot, monkeypatch):
    env = build_env(SessionConfig(task="pick_place", robot=robot, cameras="all"), 20)
    spared = env.reset(seed=3)[0]["pixels"]
    assert env.simulation.mujoco_model.vis.quality.numstacks == 2
    monkeypatch.setattr(rendering, "bulges", lambda model: True)
    whole = env.reset(seed=3)[0]["pixels"]
    assert env.simulation.mujoco_model.vis.quality.numstacks > 2
    env.close()
    for camera, picture in spared.items():
        assert np.abs(picture.astype(int) - whole[camera]).mean() < 0.3, camera


@pytest.mark.needs_gl
def test_whatbulges_stays_round():
    text = """<mujoco><worldbody>
        <camera name='eye' pos='0 -5 0' euler='90 0 0'/>
        <geom type='sphere' size='1' group='1' rgba='1 1 1 1'/>
    </worldbody></mujoco>"""
    model, painter = mujoco.MjModel.from_xml_string(text), Painter((64, 64))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    ball = (painter.paint(model, data, "eye") > 10).any(axis=2)
    painter.close()
    width, height = ball.any(axis=0).sum(), ball.any(axis=1).sum()
    assert 0.74 < ball.sum() / (width * height) < 0.83  # π/4; of a double cone it is a half


@pytest.mark.needs_gl
def test_things_are_drawn_however_many_there_are():
    """A wall behind 400 small boxes, the last of the scene, is seen."""
    small, pictures = Shape("box", np.full(3, 0.02)), []
    boxes = [SceneObject(f"box_{n}", small, np.array([5.0, 0.05 * n, 0.02])) for n in range(400)]
    wall = SceneObject("wall", Shape("box", np.array([0.5, 0.5, 0.5])), np.array([1.2, 0.0, 0.5]))
    for things in (boxes, [*boxes, wall]):
        start = Start(Scene(tuple(things)), load_model().description.home)
        task = FixedTask(start, lambda state: Verdict(False), 10.0)
        with closing(HandrailEnv(task, plant=Simulation, cameras=("scene",))) as env:
            pictures.append(env.reset(seed=0)[0]["pixels"]["scene"].astype(int))
    assert np.abs(pictures[1] - pictures[0]).max() > 50
