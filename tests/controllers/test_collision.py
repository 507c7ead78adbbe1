"""Distances' laws: those of coal, gradients against finite differences, bounds."""

import numpy as np
import pytest

from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.numerics.rotation import matrix_from_rpy
from handrail.controllers.robot.model import load_model
from handrail.controllers.robot.shape import Obstacle, Shape

MODEL = load_model()


def scene(rng):
    shapes = [Shape("box", [0.3, 0.2, 0.5]), Shape("cylinder", [0.2, 0.5]), Shape("sphere", [0.2])]
    shapes.append(Shape("capsule", [0.1, 0.4]))
    standing = [
        Obstacle(f"o{i}", shape, rng.uniform([-1, -1, 0], [2, 2, 1.5])) for i, shape in enumerate(shapes)
    ]
    turn = matrix_from_rpy([0.3, -0.2, 0.5])
    return (*standing, Obstacle("held", Shape("box", [0.4, 0.3, 0.4]), [0.02, 0.05, 0.1], turn, frame="tool"))


@pytest.mark.parametrize("order", [1, -1])
def test_held_and_moving_objects_meet_in_either_order(order):
    """Law: what is known of now says of a moment to come at most the distance then."""
    q = MODEL.description.home
    ball = Obstacle(
        "ball", Shape("sphere", [0.1]), MODEL.pose(q).position + [0, -1.0, 0], velocity=[0, 1.0, 0]
    )
    cup = Obstacle("cup", Shape("box", [0.1, 0.1, 0.1]), [0, 0, 0.1], frame="tool")
    collision = CollisionModel(MODEL, (cup, ball)[::order])
    now, path, times = collision.values(q[None])[0], np.stack([q, q]), np.array([0.0, 1.0])
    known = collision.values(path, times, (q, now), np.full(collision.size, 0.25))
    exact = collision.values(path, times)
    assert np.all(known <= exact + 1e-9)
    assert exact[1, collision.pairs.index(("cup", "ball"))] < 0.0


def test_a_distance_that_is_no_number_is_an_error(monkeypatch):
    block = Obstacle("block", Shape("box", [0.6, 0.6, 0.6]), [*MODEL.description.home[:2], 0.5])
    collision = CollisionModel(MODEL, (block,))
    monkeypatch.setattr("handrail.controllers.collision.shape_pairs.coal.distance", lambda *_: 0.0)
    with pytest.raises(HandrailError, match=r"distance of .* and block: expected numbers, got NaN"):
        collision.values(MODEL.description.home[None])


@pytest.mark.parametrize("kind", ["sphere", "capsule", "cylinder"])
@pytest.mark.parametrize("held", ["sphere", "capsule", "cylinder"])
def test_shapes_on_one_axis_overlap_as_much_as_beside_it(held, kind):
    """Law: the value is continuous there, and the gradient leads out."""
    sizes = {"sphere": [0.05], "capsule": [0.05, 0.3], "cylinder": [0.05, 0.3]}
    q, found = MODEL.description.home, []
    pose = MODEL.pose(q)
    for aside in (0.0, 1e-5):
        place = pose.position + aside * pose.rotation[:, 0]
        cup = Obstacle("cup", Shape(held, sizes[held]), [0.0, 0.0, 0.0], frame="tool")
        post = Obstacle("post", Shape(kind, sizes[kind]), place, pose.rotation)
        collision = CollisionModel(MODEL, (cup, post))
        row, distances = collision.pairs.index(("cup", "post")), collision.distances(q[None])
        gradient = distances.gradients[distances.near[:, 1] == row]
        found.append((distances.values[0, row], np.linalg.norm(gradient)))
    assert found[0][0] == pytest.approx(found[1][0], abs=1e-3)
    assert found[0][0] < -0.05
    assert found[0][1] > 0.3


def test_gradients_are_the_derivatives_of_the_distances():
    rng = np.random.default_rng(0)
    collision, h = CollisionModel(MODEL, scene(rng)), 1e-3
    checked = 0
    for _ in range(20):
        q = rng.uniform(-1.5, 1.5, MODEL.size)
        distances = collision.distances(q[None])
        steps = h * np.eye(MODEL.size)
        after, before = collision.values(q + steps), collision.values(q - steps)
        slopes = ((after - before) / (2 * h)).T  # (P, n)
        pair = distances.near[:, 1]
        apart = distances.values[0, pair] > 0.02
        error = np.abs(distances.gradients - slopes[pair])[apart]
        checked += len(error)
        assert np.median(error) < 1e-3
        assert np.quantile(error, 0.98) < 2e-2  # coal's own tolerance, and kinks at edges
    assert checked > 500


def test_skipped_pairs_are_far():
    """Values that are not measured are lower bounds, and never of a pair within reach."""
    rng = np.random.default_rng(4)
    collision = CollisionModel(MODEL, scene(rng))
    for _ in range(30):
        start = rng.uniform(-1.5, 1.5, MODEL.size)
        path = start + np.cumsum(rng.uniform(-0.05, 0.05, (30, MODEL.size)), axis=0)
        exact = collision.values(path)
        distances = collision.distances(path, within=0.3)
        assert np.all(distances.values <= exact + 1e-5)
        near = exact < 0.3
        np.testing.assert_allclose(distances.values[near], exact[near], atol=1e-5)
        cheap = collision.values(path, None, (path[0], exact[0]), np.full(collision.size, 0.15))
        assert np.all(cheap <= exact + 1e-5)
        np.testing.assert_allclose(cheap[exact < 0.15], exact[exact < 0.15], atol=1e-5)
        reach = rng.uniform(0.0, 0.4, collision.size)
        cheap, near = collision.values(path, None, (path[0], exact[0]), reach), exact < reach
        assert np.all(cheap <= exact + 1e-5)
        np.testing.assert_allclose(cheap[near], exact[near], atol=1e-5)


def test_far_pairs_of_an_obstacle_are_forgotten_when_it_has_moved():
    far, near = (Obstacle("ball", Shape("sphere", [0.1]), [x, 0.0, 0.14]) for x in (9.0, -0.8))
    collision, path = CollisionModel(MODEL, (far,)), np.tile(MODEL.description.home, (3, 1))
    assert not np.any(collision.distances(path, within=0.3).values[:, -1] < 0.3)
    collision.update_scene((near,))
    exact = collision.values(path)
    distances = collision.distances(path, within=0.3)
    np.testing.assert_allclose(distances.values[exact < 0.3], exact[exact < 0.3], atol=1e-5)
    row = collision.pairs.index(("chassis", "ball"))
    assert np.all(distances.values[:, row] < 0.3)


def test_moving_obstacles_are_where_they_will_be():
    ball = Obstacle("ball", Shape("sphere", [0.1]), [2.0, 0.0, 0.14], velocity=[-0.5, 0.0, 0.0])
    collision = CollisionModel(MODEL, (ball,))
    q, times = np.tile(MODEL.description.home, (3, 1)), np.array([0.0, 1.0, 2.0])
    row = collision.pairs.index(("chassis", "ball"))
    expected = 2.0 - 0.5 * times - 0.1 - (-1.5 + 0.48)
    np.testing.assert_allclose(collision.values(q, times)[:, row], expected, atol=1e-6)
    np.testing.assert_allclose(collision.distances(q, np.inf, times).values[:, row], expected, atol=1e-6)
    nearer = Obstacle("ball", ball.shape, [1.0, 0.0, 0.14])
    collision.update_scene((nearer,))
    np.testing.assert_allclose(collision.values(q, times)[:, row], expected[0] - 1.0, atol=1e-6)
    with pytest.raises(HandrailError, match="obstacles: expected ball as they were, got none"):
        collision.update_scene((Obstacle("none", ball.shape, [1, 0, 0]),))
    with pytest.raises(HandrailError, match="obstacles: expected ball as they were, got ball"):
        collision.update_scene((Obstacle("ball", Shape("sphere", [0.2]), [1, 0, 0]),))


def test_only_near_pairs_have_gradients():
    collision = CollisionModel(MODEL)
    home = np.tile(MODEL.description.home, (3, 1))
    distances = collision.distances(home, within=0.3)
    assert len(distances.near) == np.sum(distances.values < 0.3) > 0
    assert not len(collision.distances(home, within=-np.inf).near)


def test_work_pairs_are_tools_at_work_surfaces():
    table = Obstacle("table", Shape("box", [1, 1, 1]), [3, 0, 0.5], work_surface=True)
    wall = Obstacle("wall", Shape("box", [1, 1, 1]), [-3, 0, 0.5])
    collision = CollisionModel(MODEL, (table, wall))
    work = {pair for pair, is_work in zip(collision.pairs, collision.work, strict=True) if is_work}
    assert work == {("fingers", "table")}


@pytest.mark.parametrize("names", [("a", "a"), ("floor",), ("palm",)])
def test_things_have_names_of_their_own(names):
    things = [Obstacle(name, Shape("sphere", [0.1]), [1, 0, 0]) for name in names]
    with pytest.raises(HandrailError, match=f"and shapes: expected each once, got '{names[0]}' twice"):
        CollisionModel(MODEL, tuple(things))
