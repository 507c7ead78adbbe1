"""What is to be done can be read from the first pictures, so no script steers to what no camera has shown."""

import numpy as np
import pytest

from handrail.collect.config import SessionConfig
from handrail.collect.session.build import build_env
from handrail.collect.world.geometry import VISIBLE_GROUP
from handrail.collect.world.gl import mujoco

pytestmark = pytest.mark.needs_gl
SEEDS = 8


def sizes(task: str, size: str, name: str) -> np.ndarray:
    """Return the larger side of what cameras show of an object in first pictures [px], the best camera's."""
    config = SessionConfig(task=task, cameras="front,wrist", image_size=size)
    env, found = build_env(config, 20), []
    seen = mujoco.MjvOption()
    seen.geomgroup[:] = 0
    seen.geomgroup[VISIBLE_GROUP] = 1
    for seed in range(SEEDS):
        env.reset(seed=seed)
        model, data = env.simulation.mujoco_model, env.simulation.data
        of_it = [geom for geom in range(model.ngeom) if model.body(model.geom_bodyid[geom]).name == name]
        with mujoco.Renderer(model, *config.image_shape) as renderer:
            renderer.enable_segmentation_rendering()
            best = 0
            for camera in config.camera_names:
                renderer.update_scene(data, camera, seen)
                numbers, kinds = np.moveaxis(renderer.render(), -1, 0)
                rows = np.argwhere(np.isin(numbers, of_it) & (kinds == mujoco.mjtObj.mjOBJ_GEOM))
                best = max(best, int(np.ptp(rows, axis=0).max()) + 1 if len(rows) else 0)
            found.append(best)
    env.close()
    return np.array(found)


@pytest.mark.parametrize(
    ("task", "size", "name", "least"),
    [
        ("reach", "224", "goal", 12),
        ("pick_place", "640x360", "cube", 6),
        ("pick_place", "640x360", "bin", 12),
    ],
)
def test_a_target_is_seen_before_the_robot_moves(task, size, name, least):
    """It is in a picture in every episode, nearly always large enough to be read."""
    found = sizes(task, size, name)
    assert found.min() > 0
    assert np.mean(found >= least) >= 0.9
