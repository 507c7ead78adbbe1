"""The certificate measures how much too near a motion comes."""

import numpy as np
import pytest
from ideal_robot import HOME, MODEL, REST

from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.collision.surroundings import Surroundings
from handrail.controllers.interface.command import Status
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.trajectory import Trajectory
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.robot.model import load_model
from handrail.controllers.robot.shape import Obstacle, Shape
from handrail.controllers.safety.backup import full_stop
from handrail.controllers.safety.certificate import Certificate
from handrail.controllers.safety.limiter import Limiter

FRONT = HOME[0] + 0.48  # of the chassis [m]
FORWARD = np.eye(MODEL.size)[0]


def violation_of(v, obstacle):
    """Return what a full stop from home violates."""
    collision = CollisionModel(MODEL, (obstacle,))
    least = 0.3 * Surroundings.of(collision, 0.1, 0.1).margins
    certificate = Certificate(collision, least, span=1.0)
    stop = full_stop(Limiter(MODEL.description), v, 0.1)
    return certificate.violation(stop, HOME, collision.values(HOME[None])[0])


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


@pytest.mark.parametrize("dt", [0.1, 0.5])
@pytest.mark.parametrize("stages", [0, 1, 3])
def test_nothing_thin_stands_between_the_samples_of_a_motion(stages, dt):
    """Law: a motion falls as short of safety as its path at any time, but for half of a least distance."""
    rng, limits, found = np.random.default_rng(0), MODEL.description.limits, 0
    for _ in range(40):
        v = rng.uniform(-1.0, 1.0, (stages + 1, MODEL.size)) * limits.velocity
        elapsed = rng.uniform(0.0, dt) if stages else 0.0
        motion = Trajectory(Limiter(MODEL.description).to_rest(v, dt), dt, elapsed)
        path, times = motion.path(HOME, 100)
        hand = MODEL.pose(path[rng.integers(len(path) // 4, 3 * len(path) // 4)]).position
        velocity = rng.uniform(-0.5, 0.5, 3) * rng.integers(2)
        lamp = Obstacle("lamp", Shape("sphere", [0.01]), hand, velocity=velocity)
        collision = CollisionModel(MODEL, (lamp,))
        least, now = 0.3 * Surroundings.of(collision, 0.1, 0.1).margins, collision.values(HOME[None])[0]
        certificate = Certificate(collision, least, span=1.0)
        short = (np.minimum(least, now - 1e-3) - collision.values(path, times)).max(axis=1)
        violation = certificate.violation(motion, HOME, now)
        assert short.max() - violation.all <= 0.5 * least.max()
        assert violation.all <= 0.0 or violation.time <= motion.path(HOME)[1][-1] or velocity.any()
        found += violation.all > 0.0
    assert found > 20


def test_a_joint_that_sags_past_its_end_does_not_hold_the_others():
    """Its target is inside, where it is measured is not: no farther than now is no farther than there."""
    model = load_model("lekiwi")
    mpc, limits, period = MaskedMpc(model), model.description.limits, 0.05
    mpc.reset()
    expected = np.array(model.description.home)
    expected[7] = limits.position_upper[7] - 0.005
    q, v = expected.copy(), np.zeros(model.size)
    q[7] = limits.position_upper[7] + 0.03
    mask = mpc.channels.mask("joint")
    values = np.where(np.arange(len(mask)) == mpc.channels.joint_slice.start + 3, 0.5, 0.0)
    for step in range(1, 31):
        state = State(q, v, step * period, v, expected)
        command = mpc.update(state, Intent(values, mask, time=step * period))
        assert command.diagnostics.status is not Status.BACKUP
        way = 0.5 * period * (v + command.velocity(period))
        q, expected, v = q + way, expected + way, command.velocity(period)
    assert expected[3] - model.description.home[3] > 0.5


@pytest.mark.parametrize(
    ("excess", "way", "hard"), [(0.05, 0.005, 0.005), (0.0, 0.005, 0.0), (0.05, -0.02, 0.0)]
)
def test_a_joint_beyond_its_range_goes_no_farther(excess, way, hard):
    """Not even by what one that is within may: each update would add that anew."""
    q, stop = np.array(HOME), np.zeros((3, MODEL.size))
    q[1] = MODEL.description.limits.position_upper[1] + excess
    stop[1, 1] = way / 0.1
    collision = CollisionModel(MODEL)
    certificate = Certificate(collision, np.zeros(collision.size), span=1.0)
    violation = certificate.violation(Trajectory(stop, 0.1), q, collision.values(q[None])[0])
    assert violation.hard == pytest.approx(hard)
