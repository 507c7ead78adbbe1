"""Several sources ask at once: a sum of masked tracking terms, each with its own prediction."""

from dataclasses import replace

import numpy as np
import pytest
from fuzz_helpers import PERIOD, RudeOperator
from ideal_robot import HOME, LIMITS, MODEL

from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Status
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.frames import Frames
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.prediction import Bounded, Extrapolated, Smoothed, constant
from handrail.controllers.interface.sources import Intents, IntentSource, Preview
from handrail.controllers.mpc.masked_mpc import MaskedMpc
from handrail.controllers.objectives.tracking import tracking
from handrail.controllers.robot.model import load_model

CHANNELS = Channels.of(MODEL.description)
SIZE = CHANNELS.size
REST = State(HOME, np.zeros(len(HOME)), time=0.05)
PREDICTIONS = [constant, Bounded(CHANNELS), Extrapolated(), Smoothed(Bounded(CHANNELS), 0.1)]


def intent(values, *groups, time=0.05, **other):
    return Intent(np.asarray(values, dtype=float), CHANNELS.mask(*groups), time=time, **other)


def together(*sources, base=None):
    return Intents.of(sources, (0.0,), base or sources[0].intent)


def drawn(rng, share=0.5, time=0.05):
    return Intent(rng.uniform(-0.2, 0.2, SIZE), rng.random(SIZE) < share, time=time)


@pytest.mark.parametrize("predict", PREDICTIONS)
def test_one_source_is_bit_for_bit_the_intent(predict):
    rng = np.random.default_rng(0)
    rude = [RudeOperator(CHANNELS, LIMITS, np.random.default_rng(7)) for _ in range(2)]
    alone, wrapped = (MaskedMpc(MODEL, predict=predict) for _ in range(2))
    q, v, commanded = HOME.copy(), np.zeros(len(HOME)), np.zeros(len(HOME))
    for step in range(1, 201):
        state = State(q, v, step * PERIOD, commanded)
        one, same = (each.intent(state.time) for each in rude)
        together = Intents.of([IntentSource("person", same)], same.grippers, same)
        first, second = alone.update(state, one), wrapped.update(state, together)
        assert np.array_equal(first.velocities, second.velocities)
        assert first.diagnostics.status == second.diagnostics.status
        commanded = first.velocity(PERIOD)
        q, v = q + PERIOD * commanded, commanded + rng.normal(0, 1e-4, len(q))


@pytest.mark.parametrize("seed", range(8))
def test_disjoint_masks_are_their_union(seed):
    rng = np.random.default_rng(seed)
    whole = drawn(rng, 0.7)
    part = rng.random(SIZE) < 0.5
    one, other = (replace(whole, mask=whole.mask & mine) for mine in (part, ~part))
    found = MaskedMpc(MODEL).update(
        REST, together(IntentSource("a", one), IntentSource("b", other), base=whole)
    )
    assert np.array_equal(found.velocities, MaskedMpc(MODEL).update(REST, whole).velocities)


@pytest.mark.parametrize("seed", range(8))
def test_the_terms_add_up(seed):
    """The one term of the problem is the sum of the sources' terms, but for a constant."""
    rng = np.random.default_rng(seed)
    sources = [IntentSource(name, drawn(rng), rng.uniform(0.0, 2.0, SIZE)) for name in "abc"]
    problem = MaskedMpc(MODEL).build_problem(REST, together(*sources))
    unit = MaskedMpc(MODEL).build_problem(REST, replace(drawn(rng), mask=np.ones(SIZE, bool))).weights

    def sum_of_terms(u):
        weights = [unit[:, :SIZE] * each.weight * each.intent.mask for each in sources]
        return sum(
            (weight * (u - each.intent.values) ** 2).sum()
            for weight, each in zip(weights, sources, strict=True)
        )

    def one_term(u):
        return (problem.weights[:, :SIZE] * (u - problem.reference[:, :SIZE]) ** 2).sum()

    points = rng.normal(0, 1, (5, SIZE))
    differences = [sum_of_terms(u) - one_term(u) for u in points]
    assert np.allclose(differences, differences[0], rtol=1e-9)
    assert differences[0] >= 0.0


@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 1.0])
def test_equal_channels_are_the_weighted_mean(share):
    """Where nothing else pulls: the base's speeds of a robot that is driven for long enough."""
    one, other = np.array([0.4, 0.0, 0.2]), np.array([0.0, 0.3, -0.2])
    controller, q, commanded = MaskedMpc(MODEL), HOME.copy(), np.zeros(len(HOME))
    padded = [np.concatenate([each, np.zeros(SIZE - 3)]) for each in (one, other)]
    for step in range(1, 41):
        time = step * PERIOD
        pair = zip("ab", padded, (1.0 - share, share), strict=True)
        sources = [IntentSource(name, intent(each, "base", time=time), weight) for name, each, weight in pair]
        state = State(q, commanded, time, commanded)
        command = controller.update(state, together(*sources))
        assert command.diagnostics.status is Status.OK
        commanded = command.velocity(PERIOD)
        q = q + PERIOD * commanded
    c, s = np.cos(q[2]), np.sin(q[2])
    found = [c * commanded[0] + s * commanded[1], -s * commanded[0] + c * commanded[1], commanded[2]]
    assert np.allclose(found, (1.0 - share) * one + share * other, atol=0.01)


def test_a_source_without_weight_changes_nothing_even_if_it_is_stale():
    ask = intent(np.full(SIZE, 0.2), "ee")
    silent = IntentSource("policy", intent(np.full(SIZE, -0.4), "ee", time=-9.0), 0.0)
    found = MaskedMpc(MODEL).update(REST, together(IntentSource("person", ask), silent))
    assert np.array_equal(found.velocities, MaskedMpc(MODEL).update(REST, ask).velocities)


def test_values_on_channels_not_owned_mean_nothing():
    """An infinite value under the mask, a source of another size that owns nothing."""
    one, other = intent(np.full(SIZE, 0.2), "ee"), intent(np.full(SIZE, 0.1), "ee", "base")
    wild = replace(one, values=np.where(one.mask, one.values, np.inf))
    nothing = IntentSource("c", Intent(np.ones(3), np.zeros(3, bool), time=0.05), np.ones(SIZE))
    clean = together(IntentSource("a", one), IntentSource("b", other))
    found = together(IntentSource("a", wild), IntentSource("b", other), nothing)
    assert np.array_equal(found.values, clean.values)
    commands = [MaskedMpc(MODEL).update(REST, each) for each in (found, clean)]
    assert commands[0].diagnostics.status is Status.OK
    assert np.array_equal(commands[0].velocities, commands[1].velocities)


def test_each_source_has_its_own_prediction():
    """A policy's chunk is in the reference of each stage; a person's command is held."""
    person = intent(np.full(SIZE, 0.1), "base")
    rows = np.linspace(0.0, 0.4, 5)[:, None] * np.ones(SIZE)
    plan = Preview(rows, 0.05 + 0.25 * np.arange(5))
    policy = IntentSource("policy", intent(rows[0], "ee"), predict=plan)
    problem = MaskedMpc(MODEL).build_problem(REST, together(IntentSource("person", person), policy))
    hand, stages = CHANNELS.hand_slice(), 0.05 + 0.1 * np.arange(1, 11)
    expected = [rows[np.flatnonzero(plan.times <= time + 1e-9)[-1], 0] for time in stages]
    assert np.allclose(problem.reference[:, hand], np.array(expected)[:, None])
    assert np.allclose(problem.reference[:, CHANNELS.base_slice], 0.1)


def test_a_huge_source_is_cut_before_it_is_weighed():
    """A policy that asks for 10⁶ m/s does not shout a person down."""
    person, policy = intent(np.full(SIZE, -0.2), "ee"), intent(np.full(SIZE, 1e6), "ee")
    problem = MaskedMpc(MODEL).build_problem(
        REST, together(IntentSource("a", person), IntentSource("b", policy))
    )
    assert np.allclose(problem.reference[0, CHANNELS.hand_slice()][:3], 0.5 * (-0.2 + 2.0))


FINE = intent(np.full(SIZE, 0.1), "base")
BAD = {
    "NaN": (intent(np.full(SIZE, np.nan), "ee"), 1.0, Status.INVALID_INTENT),
    "infinite": (intent(np.full(SIZE, np.inf), "ee"), 1.0, Status.INVALID_INTENT),
    "other size": (Intent(np.zeros(3), np.ones(3, bool), time=0.05), 1.0, Status.INVALID_INTENT),
    "other frames": (intent(FINE.values, "ee", frames=Frames("world")), 1.0, Status.INVALID_INTENT),
    "no time": (intent(FINE.values, "ee", time=np.nan), 1.0, Status.INVALID_INTENT),
    "from the future": (intent(FINE.values, "ee", time=0.3), 1.0, Status.INVALID_INTENT),
    "stale": (intent(FINE.values, "ee", time=-0.3), 1.0, Status.STALE_INTENT),
    "weight is no number": (intent(FINE.values, "ee"), np.nan, Status.INVALID_INTENT),
    "weight below zero": (intent(FINE.values, "ee"), -1.0, Status.INVALID_INTENT),
    "infinite weight": (intent(FINE.values, "ee"), np.inf, Status.INVALID_INTENT),
}


@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize("name", BAD)
def test_one_bad_source_brakes_the_robot(name, first):
    ask, weight, status = BAD[name]
    sources = [IntentSource("policy", ask, weight), IntentSource("person", FINE)]
    intents = Intents.of(sources if first else sources[::-1], (0.0,), FINE)
    found = MaskedMpc(MODEL).update(REST, intents).diagnostics.status
    assert found is status


def test_a_source_that_dies_brakes_within_the_dead_man_time():
    controller, q, commanded, braked = MaskedMpc(MODEL), HOME.copy(), np.zeros(len(HOME)), None
    ask = np.concatenate([[0.3], np.zeros(SIZE - 1)])
    for step in range(1, 41):
        time = step * PERIOD
        person = intent(ask, "base", time=time)
        policy = intent(np.zeros(SIZE), "ee", time=min(time, 1.0))
        state = State(q, commanded, time, commanded)
        command = controller.update(
            state, together(IntentSource("person", person), IntentSource("policy", policy))
        )
        if command.diagnostics.status.brakes and braked is None:
            braked = time
        commanded = command.velocity(PERIOD)
        q = q + PERIOD * commanded
    assert braked is not None
    assert 1.0 < braked <= 1.3 + 1e-9
    assert np.abs(commanded).max() < 1e-3


def test_two_hands_can_have_an_owner_each():
    model = load_model("tiago_pro")
    channels = Channels.of(model.description)
    values, state = np.full(channels.size, 0.1), State(model.description.home, np.zeros(model.size), 0.05)
    one, other, both = (Intent(values, channels.mask(*g), time=0.05) for g in (["left"], ["right"], ["ee"]))
    found = MaskedMpc(model).update(
        state, Intents.of([IntentSource("person", one), IntentSource("policy", other)], (0.0, 0.0), one)
    )
    assert np.array_equal(found.velocities, MaskedMpc(model).update(state, both).velocities)


def test_the_tracking_objective_is_the_first():
    """The builder weighs its rows: the first m of all."""
    first = MaskedMpc(MODEL).residuals.objectives[0]
    assert first.name == tracking(CHANNELS, np.ones(SIZE)).name
    assert len(first.reference) == SIZE
