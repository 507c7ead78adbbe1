"""Contacts: what counts as forbidden is counted, and nothing else."""

import numpy as np
from collect_helpers import action, environment

from handrail.collect.world.scene import Scene, SceneObject, box
from handrail.collect.world.task import Start


def touched(change, joint, speed, steps):
    """Return what is touched while a joint moves from a changed start on."""
    with environment("Reach") as env:
        env.reset(seed=0)
        env.reset(options={"start": change(env.start)})
        moves = action(env, speed * np.eye(9)[joint])
        return {name for _ in range(steps) for name in env.step(moves)[4]["contact_names"]}


def test_touching_oneself_is_counted():
    q = [0.0, -1.57, 2.6, 0.0, 0.0, 0.0]
    names = touched(lambda start: Start(start.scene, np.append(start.q[:3], q), start.goal), 5, 1.0, 40)
    assert any("forearm" in name or "wrist" in name or "palm" in name for name in names), names


def test_touching_a_table_is_counted():
    table = SceneObject("table", box([0.4, 0.4, 0.4]), np.array([0.0, 0.174, 0.25]), work_surface=True)

    def beside(start):
        return Start(Scene((*start.scene.objects, table)), start.q, start.goal)

    assert any(name.endswith("table") for name in touched(beside, 4, 0.5, 30))  # home is horizontal above it
