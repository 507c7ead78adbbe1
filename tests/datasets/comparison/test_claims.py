"""A comparison claims no difference that is none, and says those that it claims first."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from compare_helpers import condition, judge

from handrail.datasets.comparison.collection import collected, rate_ratio, success_difference
from handrail.datasets.comparison.evaluations import Condition, Policy
from handrail.datasets.comparison.groups import Group
from handrail.datasets.comparison.headline import cautions, headline
from handrail.datasets.presentation.wording import p_alone, p_value
from handrail.datasets.reading.demonstration import Demonstration
from handrail.datasets.reading.reader import DatasetInfo
from handrail.datasets.statistics.contrast import adjusted
from handrail.datasets.statistics.resampling import Run

INFO = DatasetInfo(Path("one"), 20, "arm", {}, 9, 450, "", "", from_handrail=False)


def rng(*seed):
    return np.random.default_rng(seed)


def unbalanced(first, others):
    """Return a condition of one policy with very many rollouts and of nine with few."""
    shares = [(2000, first), *[(50, others)] * 9]
    return [
        Run(0, seed, tuple(range(count)), (np.arange(count) < share * count).astype(float))
        for seed, (count, share) in enumerate(shares)
    ]


def test_a_policy_with_more_rollouts_counts_as_any_other():
    """Else the difference would have another sign than the interval over policies."""
    conditions = {"a": condition("a", unbalanced(0.9, 0.5)), "b": condition("b", unbalanced(0.78, 0.8))}
    found = judge(conditions, "b", rng(11))
    (difference,) = found.differences
    assert difference.estimate == pytest.approx(0.54 - 0.798)
    for each in (difference, *found.successes.values()):
        assert each.nested[0] <= each.estimate <= each.nested[1]
    assert difference.interval[0] > 0.0 > difference.nested[1]  # of all rollouts, of the policies
    assert not difference.detected


def test_one_policy_says_nothing_of_training():
    """Of no outcome; its rollouts have their own interval."""
    runs = [Run(0, 0, tuple(range(60)), (np.arange(60) % 2).astype(float))]
    found = judge({"a": condition("a", runs, contacts=True), "b": condition("b", runs)}, "b", rng(3))
    alone = [value for value in found.values if value.label == "a"]
    assert {value.measure.name for value in alone} >= {"contacts"}
    assert all(value.interval and value.nested is None for value in alone)


def test_a_number_of_a_rollout_is_that_number():
    """`contact` and `clean` are ours only where another program does not say its own."""
    rollouts = {seed: {"success": 1.0, "contact": 3.5, "clean": 0.25} for seed in range(4)}
    policy = Policy(0, 0, {}, rollouts)
    assert [policy.run(name).values.tolist() for name in ("contact", "clean")] == [[3.5] * 4, [0.25] * 4]


def attempts(label, count, share, seconds):
    """Return episodes of one length, some of them successful."""
    meta = ({"length": 20 * seconds, "tasks": ["go"], "success": k < share * count} for k in range(count))
    return Group(label, INFO, tuple(Demonstration(k, INFO, {}, each) for k, each in enumerate(meta)))


def test_equal_rates_of_unequal_groups_are_not_taken_for_different(few_resamples):
    """A small group that varies, against a large one that does not."""
    generator, small = rng(12), 0
    for _ in range(60):
        share = float(generator.binomial(20, 0.5)) / 20
        small += rate_ratio(attempts("a", 20, share, 5), attempts("b", 100, 1.0, 10), generator).p < 0.05
    assert small <= 12


def test_the_headline_begins_with_detected_differences_and_counts_the_others():
    groups = [
        attempts(label, 60, share, 5) for label, share in zip("abcd", (0.9, 0.9, 0.88, 0.1), strict=True)
    ]
    ratios = [rate_ratio(each, groups[0], rng(13)) for each in groups[1:]]
    found = adjusted([*(success_difference(each, groups[0]) for each in groups[1:]), *ratios])
    values = [value for each in groups for value in collected(each, "", rng(14))]
    everything = SimpleNamespace(collecting=values)
    said = headline(
        SimpleNamespace(unlike=(), outcomes=None, collecting=found, everything=everything, others="bcd")
    )
    assert said.startswith("Success while collecting: d 10 %, a 90 %")
    assert said.count("a difference detected") == 2
    assert said.endswith("The tables have 3 more.")


def test_policies_of_unlike_numbers_of_rollouts_are_named():
    groups = [attempts(label, 20, 0.5, 5) for label in "ab"]
    everything = SimpleNamespace(groups=groups, differences=[], measurements=SimpleNamespace(metrics=()))
    for runs, said in ((unbalanced(0.9, 0.5)[1:], False), (unbalanced(0.9, 0.5), True)):
        found = judge(
            {"a": condition("a", runs), "b": condition("b", unbalanced(0.8, 0.8)[1:])}, "b", rng(15)
        )
        told = cautions(SimpleNamespace(everything=everything, outcomes=found))
        assert any("different numbers of rollouts" in text for text, holds in told.items() if holds) == said


@pytest.mark.parametrize(("others", "said"), [((50.0, 51.0), False), ((50.0, 100.0), True)])
def test_amounts_of_data_are_those_of_all_policies(others, said):
    """Not of the first policy of each condition alone."""
    groups = [attempts(label, 20, 0.5, 5) for label in "ab"]
    everything = SimpleNamespace(groups=groups, differences=[], measurements=SimpleNamespace(metrics=()))
    conditions = {
        label: Condition(
            label, tuple(Policy(k, k, {"episodes": e}, {0: {"success": True}}) for k, e in enumerate(learnt))
        )
        for label, learnt in (("a", (50.0, 50.0)), ("b", others))
    }
    assert conditions["a"].content["trained_on"] == {"episodes": 50.0}
    assert conditions["b"].content["trained_on"] == {"episodes": sum(others) / 2}
    found = SimpleNamespace(conditions=conditions, differences=[])
    told = cautions(SimpleNamespace(everything=everything, outcomes=found))
    assert [on for words, on in told.items() if "different amounts of data" in words] == [said]


def test_an_amount_that_some_policies_lack_has_no_mean():
    learnt = {"episodes": 50.0, "attempts": 60.0}, {"episodes": 60.0}
    policies = [Policy(k, k, each, {0: {"success": True}}) for k, each in enumerate(learnt)]
    assert Condition("a", tuple(policies)).content["trained_on"] == {"episodes": 55.0}


@pytest.mark.parametrize(
    ("p", "said"), [(3e-5, "p < 0.001"), (0.0494, "p = 0.049"), (0.0496, "p < 0.05"), (0.0504, "p = 0.05")]
)
def test_a_p_is_not_rounded_across_the_level(p, said):
    assert p_value(p) == said
    assert f"p {p_alone(p)}" == said.replace("p = ", "p ")
