"""The safety fuzz: rude intents in clutter with movers, in physics, without the environment's limiter."""

from collections import Counter

import numpy as np
import pytest
from fuzz_helpers import RudeOperator, RudePair, failing, run, watching

from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.mpc.safety_filter import safety_filter
from handrail.controllers.numerics.threads import single_threaded
from handrail.controllers.ocp.settings import MpcSettings
from handrail.controllers.robot.description import robot_names
from handrail.controllers.robot.model import load_model

EXCESS = 1e-6  # of a limit, relative, that is rounding
SPENT = 0.05  # of the updates, whose work may end before the plan keeps all limits


def check(
    seeds, seconds, movers=0, robot="ridgeback_ur10", make=MaskedMpc, failures=0.0, operator=RudeOperator
):
    """Run seeds; the robot touches neither itself nor what stands, keeps its limits, and gets somewhere."""
    model, results = load_model(robot), {}
    controller = make(model)
    with single_threaded(), watching(controller) as record:
        for seed in seeds:
            with failing(controller, seed, failures):
                results[seed] = run(model, controller, seed, seconds, movers, operator=operator)
    statuses = sum((result.statuses for result in results.values()), Counter())
    travelled = np.median([result.travelled for result in results.values()])
    assert not {seed: r.own for seed, r in results.items() if r.own}
    assert not {seed: r.standing for seed, r in results.items() if r.standing}
    assert max(result.velocity_excess for result in results.values()) < EXCESS
    assert max(result.acceleration_excess for result in results.values()) < EXCESS
    assert record.excess <= 1e-4  # a plan says how far it exceeds a limit
    assert record.spent <= SPENT * record.updates, record
    least = 0.3 * seconds * model.description.world.scale
    assert travelled > least, f"travelled {travelled} m: a robot that freezes is safe too"
    return statuses, [seed for seed, result in results.items() if result.moving]


@pytest.mark.parametrize("make", [MaskedMpc, safety_filter])
@pytest.mark.parametrize("robot", robot_names())
def test_rude_intents_in_clutter(make, robot):
    statuses, _ = check(range(1000, 1003), 5.0, make=make, robot=robot)
    assert {"ok", "invalid_intent", "stale_intent"} <= set(statuses)


@pytest.mark.parametrize("robot", robot_names())
def test_two_rude_sources_in_clutter(robot):
    statuses, _ = check(range(1000, 1003), 5.0, robot=robot, operator=RudePair)
    assert {"ok", "invalid_intent", "stale_intent"} <= set(statuses)


@pytest.mark.slow
@pytest.mark.parametrize("robot", robot_names())
def test_two_rude_sources_in_clutter_at_length(robot):
    check(range(200), 5.0, robot=robot, operator=RudePair)


@pytest.mark.parametrize("movers", [1, 2])
def test_rude_intents_among_movers(movers):
    assert not check(range(1000, 1002), 5.0, movers)[1]


def test_rude_intents_in_clutter_with_a_solver_that_fails():
    statuses, _ = check(range(1000, 1002), seconds=5.0, failures=0.05)
    assert statuses["solver_failed"] > 10


def late(robot, gaps, seeds, seconds, horizon=10):
    """Run seeds with so long between two updates; return the hand's mean way. Nothing is touched."""
    model, travelled = load_model(robot), {}
    controller = MaskedMpc(model, MpcSettings.of(model.description.world.scale, horizon=horizon))
    with single_threaded():
        for gap in gaps:
            runs = {seed: run(model, controller, seed, seconds, gap=gap) for seed in seeds}
            assert not {seed: (r.own, r.standing) for seed, r in runs.items() if r.own or r.standing}, gap
            travelled[gap] = np.mean([r.travelled for r in runs.values()])
    return travelled


@pytest.mark.parametrize("robot", robot_names())
def test_late_updates_touch_nothing(robot):
    """Beyond what was certified the robot is sent the stop that was certified with it."""
    travelled = late(robot, (0.3, 0.5, 1.0), range(1000, 1003), 5.0)
    assert min(travelled.values()) > 0.07 * load_model(robot).description.world.scale  # 0.15 to 0.28 · scale


@pytest.mark.slow
@pytest.mark.parametrize("horizon", [10, 40])
@pytest.mark.parametrize("robot", robot_names())
def test_late_updates_touch_nothing_at_length(robot, horizon):
    travelled = late(robot, (0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0), range(1000, 1012), 15.0, horizon)
    assert travelled[0.1] > 0.7 * travelled[0.05]  # updates on time stop nothing; 0.79 to 1.07


@pytest.mark.slow
@pytest.mark.parametrize("robot", robot_names())
@pytest.mark.parametrize("movers", [0, 1, 2])
def test_rude_intents_at_length(robot, movers):
    """Movers stop for nobody and can close in from two sides: met in 1 of 10 runs at most."""
    _, met = check(range(70), 15.0, movers, robot)
    assert len(met) <= 7


@pytest.mark.slow
def test_rude_intents_in_clutter_with_a_solver_that_fails_at_length():
    check(range(50), seconds=20.0, failures=0.05)
