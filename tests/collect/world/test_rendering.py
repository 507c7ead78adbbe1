"""A picture depends on what is drawn, not on what was drawn before."""

import numpy as np
import pytest

from handrail.collect.config import SessionConfig
from handrail.collect.session.build import build_env
from handrail.collect.world.rendering import Painter
from handrail.controllers.errors import HandrailError


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
