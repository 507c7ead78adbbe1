"""The stop certificate measures how much too near a stop comes."""

import numpy as np
import pytest
from ideal_robot import HOME, MODEL, REST

from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.collision.surroundings import Surroundings
from handrail.controllers.robot.shape import Obstacle, Shape
from handrail.controllers.safety.certificate import StopCertificate

FRONT = HOME[0] + 0.48  # of the chassis [m]
FORWARD = np.eye(MODEL.size)[0]


def violation_of(v, obstacle):
    """Return what a full stop from home violates."""
    collision = CollisionModel(MODEL, (obstacle,))
    least = 0.3 * Surroundings.of(collision, 0.1, 0.1).margins
    certificate = StopCertificate(collision, least, span=1.0)
    return certificate.violation(HOME, v, (HOME, collision.values(HOME[None])[0]))


@pytest.mark.parametrize(("gap", "all_", "hard"), [(0.2, 0.15, 0.135), (0.5, 0.0, 0.0)])
def test_the_way_to_rest_counts(gap, all_, hard):
    """At 0.8 m/s the base needs 0.32 m to stop; a wall is 0.2 m ahead, then 0.5 m."""
    wall = Obstacle("wall", Shape("box", [0.2, 4.0, 0.2]), [FRONT + gap + 0.1, 0.0, 0.1])
    violation = violation_of(0.8 * FORWARD, wall)
    assert violation.all == pytest.approx(all_, abs=5e-3)
    assert violation.hard == pytest.approx(hard, abs=5e-3)
    assert all_ > 0.0 or violation.all == 0.0


@pytest.mark.parametrize(("away", "all_"), [(0.35, 0.18), (1.0, 0.0)])
def test_where_obstacles_move_rest_is_not_safe_for_ever(away, all_):
    """A pillar comes at 0.5 m/s to a robot that stands: safe as long as it is farther than the span."""
    place, velocity = [FRONT + 0.2 + away, 0.0, 0.125], [-0.5, 0.0, 0.0]
    pillar = Obstacle("pillar", Shape("cylinder", [0.2, 0.25]), place, velocity=velocity)
    violation = violation_of(REST, pillar)
    assert violation.all == pytest.approx(all_, abs=1e-6)
    assert violation.hard == 0.0  # a pillar that comes by itself is nobody's fault


def test_nothing_thin_stands_between_the_samples_of_a_stop():
    """Law: a stop falls as short of safety as its path does at any time, but for half of a least distance."""
    rng = np.random.default_rng(0)
    fastest, slowing = MODEL.description.limits.velocity, MODEL.description.limits.acceleration
    for _ in range(40):
        v = rng.uniform(-1.0, 1.0, MODEL.size) * fastest
        time = np.minimum(
            np.linspace(0.0, 1.0, 400)[:, None] * np.max(np.abs(v) / slowing), np.abs(v) / slowing
        )
        path = HOME + v * time - 0.5 * np.sign(v) * slowing * time**2
        hand = MODEL.pose(path[rng.integers(100, 300)]).position
        lamp = Obstacle("lamp", Shape("sphere", [0.01]), hand)
        collision = CollisionModel(MODEL, (lamp,))
        margins = 0.3 * Surroundings.of(collision, 0.1, 0.1).margins
        now = HOME, collision.values(HOME[None])[0]
        certificate = StopCertificate(collision, margins, span=1.0)
        worst = certificate.along(path, np.zeros(len(path)), now).max(axis=0)[1]
        missed = worst - certificate.violation(HOME, v, now).all
        assert missed <= 0.5 * margins.max()
