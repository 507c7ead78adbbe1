"""Contacts: what counts as forbidden is counted, and nothing else."""

import numpy as np
from collect_helpers import action, environment

from handrail.collect.world.scene import Scene, SceneObject, box
from handrail.collect.world.task import Start


def test_touching_oneself_is_counted():
    with environment("Reach") as env:
        env.reset(seed=0)
        q = np.array(env.start.q)
        q[3:] = [0.0, -1.57, 2.6, 0.0, 0.0, 0.0]
        names = set()
        env.reset(options={"start": Start(env.start.scene, q, env.start.goal)})
        for _ in range(40):
            names.update(env.step(action(env, [0, 0, 0, 0, 0, 1.0, 0, 0, 0]))[4]["contact_names"])
        assert any("forearm" in name or "wrist" in name or "palm" in name for name in names), names


def test_touching_a_table_is_counted():
    table = SceneObject("table", box([0.4, 0.4, 0.4]), np.array([0.0, 0.174, 0.25]), work_surface=True)
    with environment("Reach") as env:
        env.reset(seed=0)
        episode = env.start
        env.reset(options={"start": Start(Scene((*episode.scene.objects, table)), episode.q, episode.goal)})
        names = set()
        for _ in range(30):  # the home pose is horizontal above this table: lower the arm
            names.update(env.step(action(env, [0, 0, 0, 0, 0.5, 0, 0, 0, 0]))[4]["contact_names"])
        assert any(name.endswith("table") for name in names)
