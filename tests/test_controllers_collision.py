"""Distances' laws: gradients against finite differences, bulk reading against one by one."""

import numpy as np
import pytest

from handrail.controllers.collision import CollisionModel, _ResultReader
from handrail.controllers.errors import HandrailError
from handrail.controllers.model import load_model
from handrail.controllers.shape import Obstacle, Shape

MODEL = load_model()


def scene(rng):
    shapes = [Shape("box", [0.3, 0.2, 0.5]), Shape("cylinder", [0.2, 0.5]), Shape("sphere", [0.2])]
    shapes.append(Shape("capsule", [0.1, 0.4]))
    return tuple(
        Obstacle(f"o{i}", shape, rng.uniform([-1, -1, 0], [2, 2, 1.5])) for i, shape in enumerate(shapes)
    )


def test_gradients_are_the_derivatives_of_the_distances():
    rng = np.random.default_rng(0)
    collision, h = CollisionModel(MODEL, scene(rng)), 1e-3
    checked = 0
    for _ in range(20):
        q = rng.uniform(-1.5, 1.5, MODEL.size)
        distances = collision.distances(q[None])
        steps = h * np.eye(MODEL.size)
        after, before = collision.distances(q + steps).values, collision.distances(q - steps).values
        slopes = ((after - before) / (2 * h)).T  # (P, n)
        pair = distances.near[:, 1]
        apart = distances.values[0, pair] > 0.02
        error = np.abs(distances.gradients - slopes[pair])[apart]
        checked += len(error)
        assert np.median(error) < 1e-3
        assert np.quantile(error, 0.98) < 2e-2  # coal's own tolerance, and kinks at edges
    assert checked > 500


def test_bulk_reading_is_reading_one_by_one():
    collision = CollisionModel(MODEL, scene(np.random.default_rng(1)))
    for q in np.random.default_rng(2).uniform(-2, 2, (10, MODEL.size)):
        collision.compute(q)
        np.testing.assert_array_equal(collision._results.read(), _ResultReader._one_by_one(collision.results))


def test_the_distance_to_a_wall_is_the_gap():
    """The chassis is 0.48 m long ahead of its centre."""
    wall = Obstacle("wall", Shape("box", [0.2, 4.0, 2.0]), [1.0, 0.0, 1.0])
    collision = CollisionModel(MODEL, (wall,))
    q = np.array(MODEL.description.home)
    q[0] = -0.5
    row = collision.pairs.index(("chassis", "wall"))
    assert collision.distances(q[None]).values[0, row] == pytest.approx(0.9 - (-0.5 + 0.48), abs=1e-6)


def test_only_near_pairs_have_gradients():
    collision = CollisionModel(MODEL)
    home = np.tile(MODEL.description.home, (3, 1))
    distances = collision.distances(home, reach=0.3)
    assert len(distances.near) == np.sum(distances.values < 0.3) > 0
    assert not len(collision.distances(home, reach=-np.inf).near)


def test_work_pairs_are_tools_at_work_surfaces():
    table = Obstacle("table", Shape("box", [1, 1, 1]), [3, 0, 0.5], work_surface=True)
    wall = Obstacle("wall", Shape("box", [1, 1, 1]), [-3, 0, 0.5])
    collision = CollisionModel(MODEL, (table, wall))
    work = {pair for pair, is_work in zip(collision.pairs, collision.work, strict=True) if is_work}
    assert work == {("fingers", "table")}


def test_obstacles_have_distinct_names():
    twin = Obstacle("a", Shape("sphere", [0.1]), [1, 0, 0])
    with pytest.raises(HandrailError, match="distinct names"):
        CollisionModel(MODEL, (twin, twin))
