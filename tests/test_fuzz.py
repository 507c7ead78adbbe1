"""The safety fuzz: rude intents in random clutter, in physics: no contact, no limit exceeded."""

import numpy as np
import pytest
from collect_helpers import environment
from fuzz_helpers import failing, run

from handrail.controllers.description import robot_names
from handrail.controllers.mpc import MaskedMpc
from handrail.controllers.safety_filter import safety_filter
from handrail.controllers.threads import single_threaded


def check(seeds, seconds, make=MaskedMpc, failures=0.0, robot="ridgeback_ur10"):
    with environment("Reach", robot=robot) as env, single_threaded():
        controller = make(env.model)
        results = []
        for seed in seeds:
            with failing(controller, seed, failures):
                results.append(run(env, controller, seed, seconds))
    smallest = np.array([result.smallest for result in results])
    contacts = {seed: r.contact_names for seed, r in zip(seeds, results, strict=True) if r.contacts}
    statuses = {}
    for result in results:
        for name, count in result.statuses.items():
            statuses[name] = statuses.get(name, 0) + count
    print(f"smallest distance: {np.quantile(smallest, [0, 0.05, 0.5]).round(3)}, {statuses}")
    assert not contacts
    assert smallest.min() > 0.0
    assert max(result.excess for result in results) < 1e-3
    return statuses


@pytest.mark.parametrize("robot", robot_names())
@pytest.mark.parametrize("make", [MaskedMpc, safety_filter])
def test_rude_intents_in_clutter(make, robot):
    statuses = check(range(1000, 1004), 5.0, make, robot=robot)
    assert {"ok", "invalid_intent"} <= set(statuses)


def test_rude_intents_in_clutter_with_a_solver_that_fails():
    statuses = check(range(1000, 1004), seconds=5.0, failures=0.05)
    assert statuses["solver_failed"] > 20


@pytest.mark.slow
@pytest.mark.parametrize("robot", robot_names())
def test_rude_intents_in_clutter_at_length(robot):
    check(range(200), seconds=20.0, robot=robot)


@pytest.mark.slow
def test_rude_intents_in_clutter_with_a_solver_that_fails_at_length():
    check(range(50), seconds=20.0, failures=0.05)
