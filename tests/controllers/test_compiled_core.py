"""Laws of the core in C: it measures what coal measures, and what it is built from says which it is."""

import os

import numpy as np
import pytest
from coal_helpers import by_coal

from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.core import building
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.robot.model import load_model
from handrail.controllers.robot.shape import Obstacle, Shape

SHAPES = (
    Shape("box", (0.3, 0.2, 0.6)),
    Shape("capsule", (0.1, 0.6)),
    Shape("sphere", (0.2,)),
    Shape("cylinder", (0.12, 0.8)),
)


@pytest.mark.parametrize("robot", ["ridgeback_ur10", "ridgeback_panda", "lekiwi"])
def test_distances_are_those_of_coal(robot):
    rng, model = np.random.default_rng(1), load_model(robot)
    obstacles = tuple(
        Obstacle(str(index), shape, rng.normal(size=3), turned(np.eye(3), rng.uniform(-3, 3)))
        for index, shape in enumerate(SHAPES)
    )
    collision, limits = CollisionModel(model, obstacles), model.description.limits
    measure, overlapping = by_coal(model, obstacles, collision.pairs), 0
    for _ in range(60):
        q = rng.uniform(np.maximum(limits.position_lower, -2), np.minimum(limits.position_upper, 2))
        expected = measure(q)
        overlapping += np.sum(expected < 0.0)
        # coal's own tolerance, which it needs for cylinders alone, is 1e-6 of a squared distance
        np.testing.assert_allclose(collision.values(q[None])[0], expected, atol=1e-5)
    assert overlapping > 5


def test_other_sources_are_another_library(tmp_path, monkeypatch):
    """A clone that is updated is built anew: a library of other sources is never loaded."""
    before = building.library()
    (tmp_path / "core.c").write_text("int one(void) { return 1; }")
    monkeypatch.setattr(building, "FOLDER", tmp_path)
    first = building.library()
    (tmp_path / "core.c").write_text("int one(void) { return 2; }")
    assert len({before, first, building.library()}) == 3


def test_without_a_compiler_pip_is_asked_for_one(tmp_path, monkeypatch):
    (tmp_path / "core.c").write_text("int one(void) { return 1; }")
    monkeypatch.setattr(building, "FOLDER", tmp_path)
    monkeypatch.setenv("PATH", os.devnull)
    assert building.get_requires_for_build_wheel() == ["ziglang"]
    with pytest.raises(OSError, match=r"expected a C compiler \(cc, gcc or clang\) or the package ziglang"):
        building.build()
