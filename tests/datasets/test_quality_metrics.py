"""Every quality metric has a golden value, closed-form or published, and laws that it keeps."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handrail.datasets.quality import effort, idle, path, safety, tracking
from handrail.datasets.quality.consistency import action_variance, state_coverage
from handrail.datasets.quality.information import information
from handrail.datasets.quality.missing import DoesNotApply

NONE = np.empty(0, int)


def rng(seed=0):
    return np.random.default_rng(seed)


def test_half_a_circle_is_two_over_pi_efficient():
    angle = np.linspace(0.0, np.pi, 2001)
    half = np.column_stack([np.cos(angle), np.sin(angle)])
    assert path.path_efficiency(half, NONE) == pytest.approx(2 / np.pi, rel=1e-6)


def test_phases_are_judged_one_by_one():
    corner = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [2.0, 2.0]])
    assert path.path_efficiency(corner, NONE) == pytest.approx(np.sqrt(8) / 4)
    assert path.path_efficiency(corner, np.array([2])) == pytest.approx(1.0)


def test_out_and_back_is_not_zero():
    there = np.linspace([0.0, 0.0, 0.0], [1.0, 2.0, 3.0], 30)
    back = np.vstack([there, there[::-1]])
    assert path.path_efficiency(back, NONE) == pytest.approx(0.0, abs=1e-12)
    assert path.path_efficiency(back, path.farthest(back)) == pytest.approx(1.0)


@given(st.integers(0, 10_000), st.integers(0, 5))
def test_efficiency_is_a_share_and_more_phases_never_lower_it(seed, count):
    walk = np.cumsum(rng(seed).normal(size=(40, 3)), axis=0)
    boundaries = np.sort(rng(seed).choice(40, count, replace=False))
    whole, parts = path.path_efficiency(walk, NONE), path.path_efficiency(walk, boundaries)
    assert 0.0 <= whole <= parts + 1e-12
    assert parts <= 1.0 + 1e-12


def test_the_gripper_changes_where_it_is_sure():
    opening = np.array([0.5, 1.0, 0.7, 0.8, 0.4, 0.2, 0.6, 0.0, 0.9])
    assert path.gripper_state(opening).tolist() == [1, 1, 1, 1, 1, 0, 0, 0, 1]
    assert path.gripper_state(np.full(4, 0.3)).tolist() == [0, 0, 0, 0]


def test_nothing_moves():
    with pytest.raises(DoesNotApply, match="nothing moves"):
        path.path_efficiency(np.zeros((9, 3)), NONE)
    with pytest.raises(DoesNotApply, match="nothing moves"):
        idle.idle_share(np.zeros((99, 3)), 20.0, pruned=True)


def test_idle_time_with_and_without_the_final_hold():
    """Golden at 22 Hz: go 2 s at 1 m/s, wait 2 s, twice; windows of 11 frames, bound 0.2 · 0.5 m.

    A window is idle if it shares at most two steps of 1/22 m with motion: 34 windows in the first wait and
    two at either end of it; 34 within the last one and two before, which is the final hold.
    """
    speed = np.repeat([1.0, 0.0, 1.0, 0.0], 44) / 22.0
    positions = np.concatenate([[0.0], np.cumsum(speed)])[:, None]
    assert idle.idle_windows(positions, 22.0).sum() == 38 + 36
    assert idle.idle_share(positions, 22.0, pruned=False) == pytest.approx(74 / 166)
    assert idle.idle_share(positions, 22.0, pruned=True) == pytest.approx(38 / 130)


def test_small_tremor_is_idle_by_the_floor():
    tremor = 0.001 * rng().normal(size=(100, 3))
    assert idle.idle_share(tremor, 20.0, pruned=False) == 1.0
    with pytest.raises(DoesNotApply, match="not longer than"):
        idle.idle_share(tremor[:10], 20.0, pruned=False)


def test_actions_that_do_not_depend_on_the_state_vary_by_their_dimension():
    """Golden: unit normal actions in three dimensions, whatever the state: trace 3."""
    states, actions = rng().normal(size=(3000, 2)), rng(1).normal(size=(3000, 3))
    owner = np.repeat(np.arange(30), 100)
    assert action_variance(states, actions, owner).mean() == pytest.approx(3.0, rel=0.05)
    assert action_variance(states, 2.0 * actions, owner).mean() == pytest.approx(12.0, rel=0.05)


def test_actions_that_the_state_decides_hardly_vary():
    states = rng().uniform(size=(3000, 2))
    owner = np.repeat(np.arange(30), 100)
    assert action_variance(states, states, owner).mean() < 2e-3


def test_neighbours_are_from_other_episodes():
    """Two episodes side by side; the actions of one vary, those of the other do not; each sees the other."""
    states = np.repeat([[0.0], [1.0]], 20, axis=0) + 1e-3 * rng().normal(size=(40, 1))
    owner = np.repeat([0, 1], 20)
    actions = owner[:, None] * rng(1).normal(size=(40, 1))
    variance = action_variance(states, actions, owner)
    assert variance[:20].min() > 0.0
    assert variance[20:].max() == 0.0
    with pytest.raises(DoesNotApply, match="only one episode"):
        action_variance(states, actions, np.zeros(40, int))


@pytest.mark.parametrize(
    ("draw", "dimensions", "entropy"),
    [
        (lambda r, n, d: r.uniform(size=(n, d)), 2, 0.0),
        (lambda r, n, d: 3.0 * r.uniform(size=(n, d)), 2, 2 * np.log(3.0)),
        (lambda r, n, d: r.normal(size=(n, d)), 1, 0.5 * np.log(2 * np.pi * np.e)),
        (lambda r, n, d: r.normal(size=(n, d)), 3, 1.5 * np.log(2 * np.pi * np.e)),
    ],
)
def test_state_coverage_is_the_entropy(draw, dimensions, entropy):
    values = state_coverage(draw(rng(), 4000, dimensions))
    assert values.mean() == pytest.approx(entropy, abs=0.08)


def test_a_robot_that_rests_has_a_finite_coverage():
    resting = np.vstack([np.zeros((50, 2)), rng().normal(size=(50, 2))])
    assert np.isfinite(state_coverage(resting)).all()
    with pytest.raises(DoesNotApply, match="only 3 frames"):
        state_coverage(np.zeros((3, 2)))


@pytest.mark.parametrize("rho", [0.0, 0.6, 0.9])
def test_mutual_information_of_two_normal_numbers(rho):
    """Golden: −½ log(1 − ρ²)."""
    state = rng().normal(size=(4000, 1))
    action = rho * state + np.sqrt(1 - rho**2) * rng(1).normal(size=(4000, 1))
    parts = information(state, action, rng(2))
    assert parts.shape == (4000,)
    assert parts.mean() == pytest.approx(-0.5 * np.log(1 - rho**2), abs=0.06)


def test_more_noise_is_less_information():
    state = rng().normal(size=(1000, 2))
    noise = rng(1).normal(size=(1000, 2))
    values = [information(state, state + level * noise, rng(2)).mean() for level in (0.1, 0.5, 2.0)]
    assert values == sorted(values, reverse=True)
    with pytest.raises(DoesNotApply, match="only 8 frames"):
        information(state[:8], state[:8], rng())


def test_tracking_error_is_against_the_next_state():
    states = np.cumsum(rng().normal(size=(50, 3)), axis=0)
    actions = np.vstack([states[1:], states[-1:]]) + [3.0, 4.0, 0.0]
    assert tracking.tracking_error(actions, states) == pytest.approx(5.0)
    with pytest.raises(DoesNotApply):
        tracking.tracking_error(actions[:1], states[:1])


def test_a_clipped_sine_is_saturated_for_two_thirds():
    """Golden: |sin| ≥ ½ for two thirds of the time; a bit more with a tolerance of 0.5 % of the range."""
    sine = np.clip(np.sin(np.linspace(0.0, 20 * np.pi, 20_001)), -0.5, 0.5)
    switch = (sine > 0).astype(float)
    action = np.column_stack([sine, switch])
    low, high = np.array([-0.5, 0.0]), np.array([0.5, 0.0])
    share = 1.0 - 2.0 / np.pi * np.arcsin(0.5 - 0.005)
    assert share == pytest.approx(2 / 3, abs=5e-3)
    assert tracking.saturation(action, low, high) == pytest.approx(share, abs=2e-3)
    assert tracking.saturation(action[:, :1], low[:1], 2.0 * high[:1]) == pytest.approx(0.5 * share, abs=2e-3)
    with pytest.raises(DoesNotApply, match="two values"):
        tracking.saturation(action[:, 1:], low[1:], high[1:])


def test_touching_an_end_once_is_no_saturation():
    triangle = np.abs(np.linspace(-1.0, 1.0, 41))[:, None]
    assert tracking.saturation(triangle, np.zeros(1), np.ones(1)) == 0.0


def test_variation_ratio():
    states = rng().normal(size=(50, 2))
    assert tracking.variation_ratio(states, states) == pytest.approx(1.0)
    assert tracking.variation_ratio(-2.0 * states + 7.0, states) == pytest.approx(2.0)
    with pytest.raises(DoesNotApply, match="never changes"):
        tracking.variation_ratio(states, np.ones((50, 2)))


def test_safety():
    distance = np.array([0.5, 0.05, -0.02, np.nan, np.inf, 0.09, 0.11])
    assert safety.smallest_distance(distance) == pytest.approx(-0.02)
    assert safety.time_within(distance, 0.1, 10.0) == pytest.approx(0.3)
    assert safety.contacts_begun(np.array([1, 1, 0, 2, 1, 3])) == 1 + 2 + 2
    assert safety.contacts_begun(np.zeros(5)) == 0.0
    assert safety.impulse(np.array([0.5, 0.0, 1.25])) == pytest.approx(1.75)
    assert safety.slack_used(np.array([0.0, 0.2, 0.1])) == pytest.approx(0.2)
    assert safety.slack_used(np.full(4, 1e-12)) == 0.0
    with pytest.raises(DoesNotApply, match="finite"):
        safety.smallest_distance(np.full(3, np.nan))


def test_effort():
    """Golden at 10 Hz over 2 s: one axis at full deflection, one at a quarter, one never used."""
    inputs = np.column_stack([np.full(20, -1.0), np.full(20, 0.5), np.zeros(20)])
    scale = np.array([1.0, 2.0, 0.0])
    assert effort.input_effort(inputs, scale, 10.0) == pytest.approx(2.0 + 0.5)
    assert effort.active_axes(inputs, scale) == pytest.approx(2.0)
    assert effort.input_reversals(inputs, scale) == 0.0
    with pytest.raises(DoesNotApply, match="ever used"):
        effort.input_effort(inputs, np.zeros(3), 10.0)


def test_reversals_pass_over_the_dead_band():
    axis = np.array([1.0, 0.0, 1.0, -1.0, 0.01, -1.0, -0.01, 1.0])[:, None]
    assert effort.input_reversals(axis, np.ones(1)) == 2.0
    assert effort.active_axes(axis, np.ones(1)) == pytest.approx(5 / 8)


def test_mode_switches():
    mode = np.array(["base", "base", "ee", "ee", "base", "base"])
    owned = np.array([[1, 0], [1, 0], [0, 1], [1, 1], [1, 0], [1, 0]], bool)
    assert effort.mode_switches(mode, None) == 2.0
    assert effort.mode_switches(None, owned) == 3.0
    assert effort.mode_switches(mode, owned) == 3.0
    with pytest.raises(DoesNotApply):
        effort.mode_switches(None, None)
