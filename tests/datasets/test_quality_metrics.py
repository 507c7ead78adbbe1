"""Every quality metric has a golden value, closed-form or published, and laws that it keeps."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from handrail.datasets.format.schema import Feature
from handrail.datasets.quality import effort, motion, safety, takeover, tracking
from handrail.datasets.quality.consistency import entropy, mutual_information, neighbour_variance
from handrail.datasets.reading.columns import ColumnNames
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply
from handrail.datasets.reading.reader import DatasetInfo

NONE = np.empty(0, int)


def rng(seed=0):
    return np.random.default_rng(seed)


def value(metric, pool=None, fps=10, **parts):
    """Return a metric of an episode with these columns; entries of the same place have the same name."""
    frames = {ColumnNames().choices(part)[0]: column for part, column in parts.items()}
    features = {
        name: Feature(str(column.dtype), column.shape[1:] or (1,), tuple("abc"[: column[0].size]))
        for name, column in frames.items()
    }
    info = DatasetInfo(Path("one"), fps, "arm", features, 1, 1, "", "", from_handrail=True)
    episode = Demonstration(0, info, frames, {"length": len(next(iter(frames.values())))})
    return metric.measure(episode, SimpleNamespace(**(pool or {})))


def test_half_a_circle_is_two_over_pi_efficient():
    angle = np.linspace(0.0, np.pi, 2001)
    half = np.column_stack([np.cos(angle), np.sin(angle)])
    assert motion.straightness(half, NONE) == pytest.approx(2 / np.pi, rel=1e-6)


def test_phases_are_judged_one_by_one():
    corner = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [2.0, 2.0]])
    assert motion.straightness(corner, NONE) == pytest.approx(np.sqrt(8) / 4)
    assert motion.straightness(corner, np.array([2])) == pytest.approx(1.0)


def test_out_and_back_is_not_zero():
    there = np.linspace([0.0, 0.0, 0.0], [1.0, 2.0, 3.0], 30)
    back = np.vstack([there, there[::-1]])
    assert motion.straightness(back, NONE) == pytest.approx(0.0, abs=1e-12)
    assert motion.straightness(back, motion.farthest(back)) == pytest.approx(1.0)


@given(st.integers(0, 10_000), st.integers(0, 5))
def test_efficiency_is_a_share_and_more_phases_never_lower_it(seed, count):
    walk = np.cumsum(rng(seed).normal(size=(40, 3)), axis=0)
    boundaries = np.sort(rng(seed).choice(40, count, replace=False))
    whole, parts = motion.straightness(walk, NONE), motion.straightness(walk, boundaries)
    assert 0.0 <= whole <= parts + 1e-12
    assert parts <= 1.0 + 1e-12


@pytest.mark.parametrize("parts", [{}, {"phase": np.zeros(60, int)}])
def test_out_and_back_in_one_phase_is_not_zero_either(parts):
    there = np.linspace([0.0, 0.0, 0.0], [1.0, 2.0, 3.0], 30)
    assert value(motion.path_efficiency, state=np.vstack([there, there[::-1]]), **parts) > 0.9


def test_the_gripper_changes_where_it_is_sure():
    opening = np.array([0.5, 1.0, 0.7, 0.8, 0.4, 0.2, 0.6, 0.0, 0.9])
    assert motion.gripper_state(opening).tolist() == [1, 1, 1, 1, 1, 0, 0, 0, 1]
    assert motion.gripper_state(np.full(4, 0.3)).tolist() == [0, 0, 0, 0]


def test_idle_time_with_and_without_the_final_hold():
    """Golden at 22 Hz: go 2 s at 1 m/s, wait 2 s, twice; windows of 11 frames, bound 0.2 · 0.5 m.

    A window is idle if it shares at most two steps of 1/22 m with motion: 34 windows in the first wait and
    two at either end of it; 34 within the last one and two before, which is the final hold.
    """
    speed = np.repeat([1.0, 0.0, 1.0, 0.0], 44) / 22.0
    positions = np.concatenate([[0.0], np.cumsum(speed)])[:, None]
    assert motion.idle_windows(positions, 22.0).sum() == 38 + 36
    assert value(motion.idle_raw, fps=22, state=positions) == pytest.approx(74 / 166)
    assert value(motion.idle_pruned, fps=22, state=positions) == pytest.approx(38 / 130)


def test_small_tremor_is_idle_by_the_floor():
    tremor = 0.001 * rng().normal(size=(100, 3))
    assert value(motion.idle_raw, fps=20, state=tremor) == 1.0


def test_actions_that_do_not_depend_on_the_state_vary_by_their_dimension():
    """Golden: unit normal actions in three dimensions, whatever the state: trace 3."""
    states, actions = rng().normal(size=(3000, 2)), rng(1).normal(size=(3000, 3))
    owner = np.repeat(np.arange(30), 100)
    assert neighbour_variance(states, actions, owner).mean() == pytest.approx(3.0, rel=0.05)
    assert neighbour_variance(states, 2.0 * actions, owner).mean() == pytest.approx(12.0, rel=0.05)


def test_actions_that_the_state_decides_hardly_vary():
    states = rng().uniform(size=(3000, 2))
    owner = np.repeat(np.arange(30), 100)
    assert neighbour_variance(states, states, owner).mean() < 2e-3


def test_neighbours_are_from_other_episodes():
    """Two episodes side by side; the actions of one vary, those of the other do not; each sees the other."""
    states = np.repeat([[0.0], [1.0]], 20, axis=0) + 1e-3 * rng().normal(size=(40, 1))
    owner = np.repeat([0, 1], 20)
    actions = owner[:, None] * rng(1).normal(size=(40, 1))
    variance = neighbour_variance(states, actions, owner)
    assert variance[:20].min() > 0.0
    assert variance[20:].max() == 0.0


@pytest.mark.parametrize(
    ("draw", "dimensions", "expected"),
    [
        (lambda r, n, d: r.uniform(size=(n, d)), 2, 0.0),
        (lambda r, n, d: 3.0 * r.uniform(size=(n, d)), 2, 2 * np.log(3.0)),
        (lambda r, n, d: r.normal(size=(n, d)), 1, 0.5 * np.log(2 * np.pi * np.e)),
        (lambda r, n, d: r.normal(size=(n, d)), 3, 1.5 * np.log(2 * np.pi * np.e)),
    ],
)
def test_state_coverage_is_the_entropy(draw, dimensions, expected):
    values = entropy(draw(rng(), 4000, dimensions))
    assert values.mean() == pytest.approx(expected, abs=0.08)


@pytest.mark.parametrize("rho", [0.0, 0.6, 0.9])
def test_mutual_information_of_two_normal_numbers(rho):
    """Golden: −½ log(1 − ρ²)."""
    state = rng().normal(size=(4000, 1))
    action = rho * state + np.sqrt(1 - rho**2) * rng(1).normal(size=(4000, 1))
    parts = mutual_information(state, action, rng(2))
    assert parts.shape == (4000,)
    assert parts.mean() == pytest.approx(-0.5 * np.log(1 - rho**2), abs=0.06)


def test_a_robot_that_rests_has_a_finite_coverage_and_little_information():
    """Of independent numbers 40 % are all the same: at most 0.673 nat, the entropy of resting or not."""
    state, action = rng().normal(size=(2048, 1)), rng(1).normal(size=(2048, 1))
    state[:819] = action[:819] = 0.0
    assert np.isfinite(entropy(state)).all()
    assert mutual_information(state, action, rng(2)).mean() <= 0.7


def test_tracking_error_is_against_the_next_state():
    states = np.cumsum(rng().normal(size=(50, 3)), axis=0)
    actions = np.vstack([states[1:], states[-1:]]) + [3.0, 4.0, 0.0]
    assert value(tracking.tracking_error, action=actions, state=states) == pytest.approx(5.0)


def test_a_clipped_sine_is_saturated_for_two_thirds():
    """Golden: |sin| ≥ ½ for two thirds of the time; a bit more with a tolerance of 0.5 % of the range."""
    sine = np.clip(np.sin(np.linspace(0.0, 20 * np.pi, 20_001)), -0.5, 0.5)
    switch = (sine > 0).astype(float)
    action = np.column_stack([sine, switch])
    low, high = np.array([-0.5, 0.0]), np.array([0.5, 0.0])
    share = 1.0 - 2.0 / np.pi * np.arcsin(0.5 - 0.005)
    assert share == pytest.approx(2 / 3, abs=5e-3)
    assert saturation(action, low, high) == pytest.approx(share, abs=2e-3)
    assert saturation(action[:, :1], low[:1], 2.0 * high[:1]) == pytest.approx(0.5 * share, abs=2e-3)


def test_touching_an_end_once_is_no_saturation():
    triangle = np.abs(np.linspace(-1.0, 1.0, 41))[:, None]
    from_end_to_end = np.array([[0.0], [1.0], [0.0], [0.5]])
    for action in (triangle, from_end_to_end):
        assert saturation(action, np.zeros(1), np.ones(1)) == 0.0


def saturation(action, low, high):
    return value(tracking.saturation, {"part": lambda _: SimpleNamespace(range=(low, high))}, action=action)


def test_variation_ratio():
    states = rng().normal(size=(50, 2))
    assert value(tracking.variation_ratio, action=states, state=states) == pytest.approx(1.0)
    assert value(tracking.variation_ratio, action=7.0 - 2.0 * states, state=states) == pytest.approx(2.0)


def test_safety():
    distance = np.array([0.5, 0.05, -0.02, np.nan, np.inf, 0.09, 0.11])
    assert value(safety.smallest_distance, distance=distance) == pytest.approx(-0.02)
    assert value(safety.time_within_margin, {"margin": 0.1}, distance=distance) == pytest.approx(0.3)
    assert value(safety.contacts, contacts=np.array([1, 1, 0, 2, 1, 3])) == 1 + 2 + 2
    assert value(safety.contacts, contacts=np.zeros(5)) == 0.0
    assert value(safety.impulse, impulse=np.array([0.5, 0.0, 1.25])) == pytest.approx(1.75)
    assert value(safety.slack_used, slack=np.array([0.0, 0.2, 0.1])) == pytest.approx(0.2)
    assert value(safety.slack_used, slack=np.full(4, 1e-12)) == 0.0


def test_a_contact_that_was_not_measured_is_none():
    assert value(safety.contacts, contacts=np.array([0.0, 1.0, np.nan, 1.0, 0.0, 2.0])) == 3.0


def steered(metric, inputs, scale):
    return value(metric, {"input_scale": scale}, asked=inputs)


def test_effort():
    """Golden at 10 Hz over 2 s: one axis at full deflection, one at a quarter, one never used."""
    inputs = np.column_stack([np.full(20, -1.0), np.full(20, 0.5), np.zeros(20)])
    scale = np.array([1.0, 2.0, 0.0])
    assert steered(effort.input_effort, inputs, scale) == pytest.approx(2.0 + 0.5)
    assert steered(effort.active_axes, inputs, scale) == pytest.approx(2.0)
    assert steered(effort.input_reversals, inputs, scale) == 0.0


@pytest.mark.parametrize("part", [{"owned": [True, False, True]}, {"owner": [2, 1, 2]}])
def test_axes_not_owned_are_no_input_where_the_mask_has_the_grippers_too(part):
    rows = {name: np.tile(row, (20, 1)) for name, row in part.items()}
    assert value(effort.active_axes, {"input_scale": np.ones(2)}, asked=np.ones((20, 2)), **rows) == 1.0


def test_reversals_pass_over_the_dead_band():
    axis = np.array([1.0, 0.0, 1.0, -1.0, 0.01, -1.0, -0.01, 1.0])[:, None]
    assert steered(effort.input_reversals, axis, np.ones(1)) == 2.0
    assert steered(effort.active_axes, axis, np.ones(1)) == pytest.approx(5 / 8)
    assert steered(effort.input_idle, axis, np.ones(1)) == pytest.approx(3 / 8)


def test_readings_of_devices_are_recorded_of_people_alone():
    keys = np.array(["", "keyboard", "keyboard"])
    age, back = np.array([0.0, 0.01, 0.03]), np.array([0, 1, 2])
    assert value(effort.undos, device=keys, undos=back) == 2.0
    assert value(effort.input_age, device=keys, age=age) == pytest.approx(0.01 + 0.9 * 0.02)
    assert value(effort.round_trip, device=keys, round_trip=age) == pytest.approx(0.01 + 0.95 * 0.02)


def test_mode_switches():
    mode = np.array(["base", "base", "base", "ee", "ee", "base", "base"])
    owned = np.array([[1, 0], [0, 0], [1, 0], [0, 1], [1, 1], [1, 0], [1, 0]], bool)  # a pause is none
    assert value(effort.mode_switches, mode=mode) == 2.0
    assert value(effort.mode_switches, owned=owned) == value(effort.mode_switches, owner=owned + 1) == 3.0
    assert value(effort.mode_switches, mode=mode, owned=owned) == 3.0


def test_take_overs():
    """Golden at 10 Hz: two take-overs of 0.3 s and 0.1 s, a third of 0.2 s to the end."""
    taken = np.array([0, 1, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1], bool)
    assert value(takeover.interventions, intervention=taken) == 3.0
    assert value(takeover.intervention_rate, intervention=taken) == pytest.approx(3 / 1.2 * 60)
    assert value(takeover.intervention_length, intervention=taken) == pytest.approx(0.2)
    assert value(takeover.intervention_share, intervention=taken) == pytest.approx(0.5)
    assert value(takeover.interventions, intervention=~taken) == 3.0


def test_take_overs_are_measured():
    """Of the base, a hand, the pair, two joints, a gripper; in the last frame a demonstration."""
    names = ("base.vx", "left.vx", "pair.vx", "joint.a", "joint.b", "right.gripper")
    rows = [
        [2, 1, 0, 0, 0, 1],
        [0, 2, 1, 3, 0, 1],
        [0, 1, 3, 0, 2, 1],
        [0, 1, 0, 0, 2, 2],
        [2, 2, 2, 2, 2, 2],
    ]
    taken, owners = np.array([1, 1, 1, 1, 0], bool), np.array(rows)
    features = {"owner": Feature("int64", (6,), names), "intervention": Feature("bool")}
    info = DatasetInfo(Path("one"), 10, "arm", features, 1, 1, "", "", from_handrail=True)
    episode = Demonstration(0, info, {"owner": owners, "intervention": taken}, {"length": 5})
    shares = [metric.measure(episode, None) for metric in takeover.TAKE_OVER[-3:]]
    assert shares == pytest.approx([1 / 5, 3 / 5, 3 / 5])


ROWS = rng().normal(size=(40, 2))
BUTTONS = np.array([[0.0], [1.0]] * 9)
REFUSED = [
    (lambda: motion.straightness(np.zeros((9, 3)), NONE), "nothing moves"),
    (lambda: value(motion.idle_pruned, fps=20, state=np.zeros((99, 3))), "nothing moves"),
    (lambda: value(motion.idle_raw, fps=20, state=ROWS[:10]), "not longer than"),
    (lambda: neighbour_variance(ROWS, ROWS, np.zeros(40, int)), "only one episode"),
    (lambda: entropy(ROWS[:3]), "only 3 frames"),
    (lambda: mutual_information(ROWS[:8], ROWS[:8], rng()), "only 8 frames"),
    (lambda: value(tracking.tracking_error, action=ROWS[:1], state=ROWS[:1]), "fewer than two frames"),
    (lambda: saturation(BUTTONS, np.zeros(1), np.zeros(1)), "two values"),
    (lambda: value(tracking.variation_ratio, action=ROWS, state=np.ones((40, 2))), "never changes"),
    (lambda: value(safety.smallest_distance, distance=np.full(3, np.nan)), "finite"),
    (lambda: value(safety.contacts, contacts=np.full(3, np.nan)), "finite"),
    (lambda: steered(effort.input_effort, ROWS, np.zeros(2)), "ever used"),
    (
        lambda: value(effort.round_trip, device=np.array(["keys"] * 3), round_trip=np.zeros(3)),
        "shows nothing",
    ),
    (lambda: value(effort.undos, device=np.array([""] * 3), undos=np.arange(3)), "nobody held a device"),
    (lambda: value(effort.mode_switches, state=ROWS), "no column of the mode"),
    (lambda: value(takeover.intervention_length, intervention=np.zeros(3, bool)), "nobody took over"),
    (lambda: value(takeover.intervention_share, state=ROWS), "no column 'intervention'"),
]


@pytest.mark.parametrize(("call", "words"), REFUSED)
def test_inapplicable_metrics_give_the_reason(call, words):
    with pytest.raises(DoesNotApply, match=words):
        call()
