"""Laws of the scripted hand: a perfect one is transparent, a human one is late, noisy and repeatable."""

from dataclasses import replace

import numpy as np
import pytest
from device_helpers import PERFECT

from handrail.collect.operators.modes import MODES
from handrail.collect.operators.scripted.hand import HumanHand, minimum_jerk
from handrail.collect.operators.scripted.human import HumanSettings
from handrail.collect.operators.scripted.input_map import StickMap
from handrail.collect.operators.scripted.steering import Gains
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import load_model

FULL = np.array([0.5, 0.5, 1.0])
PERIOD = 0.05


def signal(steps=200):
    times = PERIOD * np.arange(steps)
    return times, 0.4 * np.sin(np.outer(times, [1.0, 0.7, 0.3]))


def run(settings, wanted, times, seed=0):
    hand = HumanHand(settings, FULL, FULL, np.random.default_rng(seed))
    return np.array([hand.move(row, time) for row, time in zip(wanted, times, strict=True)])


def human(**numbers):
    return replace(PERFECT, **numbers)


def test_a_perfect_hand_is_transparent():
    times, wanted = signal()
    np.testing.assert_array_equal(run(PERFECT, wanted, times), wanted)


def test_delay_is_a_shift():
    times, wanted = signal()
    late = run(human(delay=0.2), wanted, times)
    np.testing.assert_allclose(late[4:], wanted[:-4])
    np.testing.assert_array_equal(late[:4], 0.0)


def test_corrections_are_intermittent():
    times, wanted = signal()
    held = run(human(refractory=0.35), wanted, times)
    moves = np.flatnonzero(np.any(np.diff(held, axis=0), axis=1))
    assert len(moves) > 10
    assert np.min(np.diff(times[moves])) >= 0.35 - 1e-9


@pytest.mark.parametrize("numbers", [{"refractory": 10.0}, {"refractory": 1.0, "movement": 0.1}])
def test_letting_go_is_immediate(numbers):
    wanted = np.array([[0.3, 0, 0]] * 3 + [[0.0, 0, 0]] * 3)
    held = run(human(**numbers), wanted, PERIOD * np.arange(6))
    np.testing.assert_array_equal(held[3:], 0.0)


def test_noise_grows_with_the_signal_and_rests_at_rest():
    times = PERIOD * np.arange(4000)
    settings = human(noise=0.1, correlation=0.5)
    small = run(settings, np.tile([0.1, 0, 0], (4000, 1)), times)
    large = run(settings, np.tile([0.4, 0, 0], (4000, 1)), times)
    assert np.std(small[:, 0]) == pytest.approx(0.01, rel=0.2)
    assert np.std(large[:, 0]) == pytest.approx(0.04, rel=0.2)
    np.testing.assert_array_equal(small[:, 1:], 0.0)


def test_the_same_seed_is_the_same_hand():
    times, wanted = signal()
    first, again, other = (run(HumanSettings(), wanted, times, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


def test_the_hand_never_leaves_the_stick():
    times, _ = signal()
    wanted = np.tile(FULL, (len(times), 1))
    moved = run(human(noise=1.0, drift=1.0, correlation=0.5), wanted, times)
    assert np.all(np.abs(moved) <= FULL)


@pytest.mark.parametrize("name", ["ridgeback_ur10", "ridgeback_panda", "lekiwi"])
def test_a_person_is_as_exact_at_the_tool_with_joints_as_with_the_hand(name):
    model, times = load_model(name), PERIOD * np.arange(4000)
    sticks = StickMap(model, MODES["direct"], Gains().within(model.description.world))
    tool, joints = sticks.channels.hand_slice(), sticks.channels.joint_slice
    hand = HumanHand(human(drift=0.02, correlation=0.2), sticks.full, sticks.fine, np.random.default_rng(0))
    wanted = 1e-9 * sticks.full  # touched, and next to nothing
    moved = np.array([hand.move(wanted, time) for time in times])
    by_hand = moved[:, tool] / sticks.full[tool]
    by_joints = moved[:, joints] @ model.jacobian(model.description.home).T / sticks.full[tool]
    assert np.sqrt(np.mean(by_hand**2)) == pytest.approx(0.02, rel=0.1)
    assert np.sqrt(np.mean(by_joints**2)) == pytest.approx(0.02, rel=0.1)


def test_a_dead_zone_is_a_share_of_what_is_fine():
    full, fine = np.array([1.0]), np.array([0.4])
    hand = HumanHand(human(threshold=0.1, refractory=0.05), full, fine, np.random.default_rng(0))
    moved = [hand.move(np.array([wanted]), float(time))[0] for time, wanted in enumerate((0.5, 0.53, 0.55))]
    assert moved == [0.5, 0.5, 0.55]


@pytest.mark.parametrize("value", [-0.1, np.nan, np.inf])
def test_wrong_settings_are_refused(value):
    with pytest.raises(HandrailError, match="--human noise: expected a number"):
        HumanSettings(noise=value)


def test_the_hand_moves_along_minimum_jerk():
    times = 0.01 * np.arange(100)
    moved = run(human(refractory=2.0, movement=0.5), np.tile([0.4, 0, 0], (100, 1)), times)
    np.testing.assert_allclose(moved[:, 0], [0.4 * minimum_jerk(time / 0.5) for time in times])
    shares = np.array([minimum_jerk(tau) for tau in np.linspace(0, 1, 1001)])
    assert np.max(np.diff(shares)) == pytest.approx(1.875e-3, rel=1e-3)  # peak speed 15/8 of the mean
