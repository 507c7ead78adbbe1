"""What a study says of its policies: only what was declared is tested, draws are pairs, never too much."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from compare_helpers import check_texts
from figure_helpers import shows
from made_study import DESIGN, FACTORS, MODES, SHARES, TASK
from scipy import stats

from handrail.datasets.presentation import wording
from handrail.datasets.statistics.contrast import holm
from handrail.datasets.statistics.replicates import (
    equivalence_p,
    equivalence_power,
    student,
    variance_of_share,
)
from handrail.policies.study import tables
from handrail.policies.study.contrasts import DECLARED, EXPLORATORY, SYSTEM, contrasts
from handrail.policies.study.declared import WORDS, declared
from handrail.policies.study.design import DeclaredPair, Flat, Robustness
from handrail.policies.study.figures import figures
from handrail.policies.study.power import detectable, plan
from handrail.policies.study.report import answer, cautions
from handrail.policies.study.results import MEASURES


def shares_of(results, task, label):
    return np.array(list(results.find(task, label).shares.values()))


def test_a_contrast_is_what_its_words_say_draw_by_draw(gathered):
    results = gathered()
    found = {(each.label, each.scope, each.measure.name): each for each in contrasts(results)}
    for scope in (("reach", "tray"), ("reach",), ("tray",)):
        ee, hand, joints, direct = (
            np.mean([shares_of(results, task, mode) for task in scope], axis=0) for mode in MODES
        )
        expected = {
            "input": (ee + hand) / 2 - (joints + direct) / 2,
            "controller": (ee + joints) / 2 - (hand + direct) / 2,
            "interaction": (ee - hand) - (joints - direct),
        }
        for name, values in expected.items():
            estimate = found[WORDS[name], ", ".join(scope), "success"]
            assert estimate.estimate == pytest.approx(values.mean())
            assert estimate.counts == (4,)
            by_scipy: Any = stats.ttest_1samp(values, 0.0)
            wider = estimate.errors[0][0] >= values.std(ddof=1) / 2 - 1e-12
            assert wider
            if estimate.errors[0][0] == pytest.approx(values.std(ddof=1) / 2):
                assert estimate.p == pytest.approx(by_scipy.pvalue)
                interval = by_scipy.confidence_interval()
                assert estimate.interval == pytest.approx((interval.low, interval.high))


def test_only_what_is_declared_is_tested_over_all_tasks(gathered):
    found: Any = contrasts(gathered())
    declared = [each for each in found if each.family == DECLARED]
    assert [each.label for each in declared] == [WORDS[name] for name in FACTORS.primary]
    assert all(each.scope == "reach, tray" for each in declared)
    assert [each.p_adjusted for each in declared] == holm([each.p for each in declared])
    others = [each for each in found if each.family != DECLARED]
    assert others
    assert all(each.p_adjusted is None and not each.detected for each in others)
    fewer: Any = contrasts(gathered(replace(DESIGN, factors=replace(FACTORS, primary=("controller",)))))
    (one,) = [each for each in fewer if each.family == DECLARED]
    assert one.p_adjusted == one.p
    same = {each.label for each in fewer if each.family == EXPLORATORY and each.scope == "reach, tray"}
    assert {WORDS["input"], WORDS["interaction"]} <= same


def test_a_success_without_contact_is_both_in_the_same_rollout(gathered):
    rows = {
        7: {"success": True, "contacts": 0},
        5: {"success": True, "contacts": 2},
        6: {"success": False, "contacts": 0},
        4: {"success": False, "contacts": 1},
    }
    (driven, *_) = gathered().find("reach", "ee").draws.values()
    driven = replace(driven, rollouts=rows)
    assert {name: driven.run(name).values.tolist() for name in MEASURES} == {
        "success": [0, 1, 0, 1],
        "contact": [1, 1, 0, 0],
        "clean": [0, 0, 0, 1],
    }


def test_only_draws_that_are_whole_count(gathered):
    results = gathered(missing=lambda job: job.cell.name == "tray/joints/2")
    found = {(e.label, e.scope): e for e in contrasts(results) if e.measure is MEASURES["success"]}
    assert found[WORDS["input"], "reach, tray"].counts == (3,)
    assert found[WORDS["input"], "reach"].counts == (4,)
    assert {each.p for each in found.values()} == {None}  # nobody stops where it suits
    assert "not tested before all draws are done" in answer(contrasts(results), DESIGN)[0]
    assert any("jobs are not done yet" in text for text, holds in cautions(results).items() if holds)


def test_draws_that_agree_by_chance_are_not_sure(gathered):
    same = dict.fromkeys(SHARES, (0.5,) * 4)
    sure = {label: (1.0 if label == "ee" else 0.0,) * 4 for label in SHARES}
    for shares in (same, sure):
        found: Any = contrasts(gathered(shares=shares))
        for each in found:
            low, high = each.interval
            assert high - low > 0.05
            assert each.p is None if each.p_adjusted is None else 0.0 < each.p <= 1.0


@pytest.mark.parametrize("contrast", ["input", "controller", "interaction"])
def test_what_is_planned_is_detected_in_four_of_five_studies(contrast):
    """Policies drawn with the design's spread and the worst rollouts, an effect as large as planned for."""
    rng, found, studies = np.random.default_rng(3), 0, 2000
    design = replace(DESIGN, draws=8, rollouts=50)
    (asked,) = (each for each in declared(design) if each.name == contrast)
    effect, sizes = detectable(design, asked), asked.parts
    total = sum(weight**2 for weight in sizes.values())
    for _ in range(studies):
        values = np.zeros(8)
        for weight in sizes.values():
            success = 0.5 + effect * weight / total + rng.normal(0.0, FACTORS.sd, (2, 8))
            shares = rng.binomial(50, np.clip(success, 0.0, 1.0)) / 50
            values += weight * shares.mean(axis=0)
        estimate: Any = student(values, least=0.0)
        found += estimate.p < 0.05 / 3
    assert found / studies == pytest.approx(0.8, abs=0.06)


PAIRS = (DeclaredPair("ee", "decoupled", margin=0.1, sd=0.05), DeclaredPair("ee", "direct", "number"))


def test_pairs_that_are_declared_are_tested_and_no_others(gathered):
    design = replace(DESIGN, factors=None, pairs=PAIRS)
    results = gathered(design)
    found: Any = contrasts(results)
    declared = [each for each in found if each.family == DECLARED]
    assert [each.label for each in declared] == ["ee − decoupled", "ee − direct (same number)"]
    assert [each.p_adjusted for each in declared] == holm([each.p for each in declared])
    for each, names in zip(
        declared, (("ee", "decoupled"), ("ee same number", "direct same number")), strict=True
    ):
        one, other = (
            np.mean([shares_of(results, t, name) for t in ("reach", "tray")], axis=0) for name in names
        )
        assert each.estimate == pytest.approx((one - other).mean())
    assert all(each.p_adjusted is None for each in found if each.family != DECLARED)
    assert {("ee − decoupled", "tray"), ("ee − direct (same number)", "reach")} <= {
        (each.label, each.scope) for each in found if each.family == EXPLORATORY
    }
    said = answer(found, design)
    assert said[0].startswith("ee − decoupled")
    assert "Equivalence of ee − decoupled within 10 points: not shown" in said[-1]
    like = gathered(design, shares=dict.fromkeys(SHARES, (0.95, 0.9, 1.0, 0.9)))
    assert "within 10 points: shown, p 0.0" in answer(contrasts(like), design)[-1]
    text = plan(design)
    assert "Declared: ee − decoupled, ee − direct (same number), over reach, tray together." in text
    assert str(tables.contrasts_table(found, DECLARED, results).rows[0][-1]).endswith("points")
    usual: Any = contrasts(gathered(replace(design, pairs=(DeclaredPair("ee", "direct"),))))
    names = [(each.label, each.scope, each.measure.name) for each in usual]
    assert len({*names}) == len(names)  # what is compared with the baseline anyway is not there twice
    assert usual[0].family == DECLARED


def test_equivalence_is_found_as_often_as_planned_and_rarely_where_there_is_none():
    """Two one-sided tests of the means of 8 draws; at the very margin they err in 5 %."""
    rng, error = np.random.default_rng(5), 0.03
    found = dict.fromkeys((0.0, 0.1), 0)
    for true in found:
        for _ in range(4000):
            values = true + error * np.sqrt(8.0) * rng.standard_normal(8)
            found[true] += (equivalence_p(student(values, least=0.0), 0.1) or 0.0) < 0.05
    assert found[0.0] / 4000 == pytest.approx(equivalence_power(0.1, error, 7), abs=0.06)
    assert found[0.1] / 4000 == pytest.approx(0.05, abs=0.015)


def test_a_system_is_compared_with_the_best_policy_alone_and_named_so(gathered):
    results = gathered()
    found = [each for each in contrasts(results) if each.family == SYSTEM]
    assert {each.measure.name for each in found} == {"success", "contact"}
    succeeded = [each for each in found if each.measure.name == "success"]
    assert all(each.label.startswith("ee intent + MPC − ee,") for each in succeeded)
    for each in (each for each in found if each.measure.name == "contact"):
        conditions = [[results.find(task, mode) for task in each.scope.split(", ")] for mode in MODES]
        touched = [np.mean([one.rolled("contact").mean() for one in some]) for some in conditions]
        assert each.sides[1] == pytest.approx(min(touched))
        assert f"− {MODES[int(np.argmin(touched))]}," in each.label
    worse = gathered(shares=dict(SHARES, ee=(0.1,) * 4))
    rivals = {"success": "joints", "contact": "ee"}  # all touch alike: the first of them
    for each in (each for each in contrasts(worse) if each.family == SYSTEM):
        assert f"− {rivals[each.measure.name]}," in each.label


def test_the_answer_is_what_was_declared_and_claims_no_more_than_was_detected(gathered):
    with_mpc = {label: (0.95 if label in ("ee", "joints") else 0.3,) * 4 for label in SHARES}
    found = contrasts(gathered(shares=with_mpc))
    said = answer(found, DESIGN)
    assert [each.label for each in found if each.detected] == [WORDS["controller"]]
    assert [sentence.split(":")[0] for sentence in said] == ["Interaction", "Controller", "Input"]
    assert [", a difference detected." in sentence for sentence in said] == [False, True, False]
    assert [", no difference detected." in sentence for sentence in said] == [True, False, True]
    values = {each.label: each.estimate for each in found if each.family == DECLARED}
    assert f"{100 * values[WORDS['controller']]:+.0f} points (95 %" in said[1]
    nothing = answer(contrasts(gathered(shares=dict.fromkeys(SHARES, (0.5,) * 4))), DESIGN)
    assert all("no difference detected" in sentence for sentence in nothing)


def test_without_factors_or_with_one_draw_nothing_is_claimed(gathered):
    plain = gathered(replace(DESIGN, factors=None))
    found = contrasts(plain)
    assert not [each for each in found if each.family == DECLARED]
    assert "ee − direct" in {each.label for each in found}
    assert "No contrast was declared" in answer(found, plain.progress.design)[0]
    open_ended = gathered(replace(DESIGN, factors=replace(FACTORS, primary=())))
    found = contrasts(open_ended)
    assert {each.family for each in found} == {EXPLORATORY, SYSTEM}
    assert {(WORDS[name], "reach, tray", "success") for name in WORDS} <= {
        (each.label, each.scope, each.measure.name) for each in found
    }
    assert all(each.p_adjusted is None for each in found)
    assert "No contrast was declared" in answer(found, open_ended.progress.design)[0]
    assert "Nothing is declared" in plan(open_ended.progress.design)
    single = gathered(replace(DESIGN, draws=1, beside=None))
    found = contrasts(single)
    assert all(each.interval is None and each.p_adjusted is None for each in found)
    assert "one draw tests nothing" in answer(found, single.progress.design)[0]
    assert any("One draw" in text for text, holds in cautions(single).items() if holds)
    assert tables.contrasts_table(found, DECLARED, single).rows


def test_a_share_of_few_is_never_certain():
    assert variance_of_share(0, 50, 50) > 0.0
    assert student([0.5], least=0.0).interval is None
    assert json.dumps(student([0.5, 0.7], least=0.0).estimate)


def test_what_ended_before_its_loss_was_flat_is_told(gathered):
    results = gathered()
    assert any("before their loss was flat" in text for text, holds in cautions(results).items() if holds)
    steady = gathered(replace(DESIGN, flat=Flat(every=5, patience=1, improvement=0.5)))
    assert not any("before their loss was flat" in text for text, holds in cautions(steady).items() if holds)


def test_undisturbed_beside_disturbed_is_the_same_policies_in_the_same_scenes(gathered):
    robust = replace(DESIGN, robustness=Robustness(("push",), ("filter",), rollouts=8, draws=2))
    results = gathered(robust)
    table = tables.treatments_table("reach", results)
    assert {row[0] for row in table.rows} == {*MODES, "ee intent"}
    robustness = figures(results, ())["robustness"]
    for condition in results.of_task("reach", treated=True):
        assert set(condition.draws) == {0, 1}
        whole = results.find("reach", condition.label)
        for draw, each in condition.draws.items():
            assert set(each.rollouts) < set(whole.draws[draw].rollouts)
        same = whole.beside(condition)
        assert shows(robustness, [100 * same.value.estimate, 100 * condition.value.estimate])
        apart = [condition.share(draw) - same.share(draw) for draw in (0, 1)]
        (row,) = (row for row in table.rows if row[:2] == (condition.label, condition.treatment))
        assert row[4] == wording.points(np.mean(apart))
        by_scipy: Any = stats.ttest_1samp(apart, 0.0)
        low, high = (float(each) for each in str(row[5]).replace("−", "-").replace("+", "").split(" to "))
        assert high - low >= 100 * np.diff(by_scipy.confidence_interval())[0] - 1.0


def test_intents_without_the_mpc_and_velocities_through_it_stand_beside_what_they_were(gathered):
    robust = replace(DESIGN, robustness=Robustness((), ("mpc", "none"), rollouts=8, draws=2))
    results = gathered(robust)
    treated = {(each.label, each.treatment) for each in results.of_task("reach", treated=True)}
    assert treated == {*((mode, "mpc") for mode in MODES), ("ee intent", "unprotected")}
    for row in tables.treatments_table("reach", results).rows:
        whole = results.find("reach", row[0])
        assert row[3] != "–"
        assert row[-1] == "50 %"  # every other scene has contact, whatever the policy
        assert set(whole.draws) >= {0, 1}


def test_figures_show_what_was_found_and_no_text_covers_another(gathered):
    names = ("reach", "tray", "pick_place")
    design = replace(
        DESIGN,
        tasks=dict.fromkeys(names, TASK),
        robustness=Robustness(("push", "shift", "delay"), rollouts=8),
    )
    results = gathered(design)
    found = contrasts(results)
    made = figures(results, found)
    assert made.keys() == {"contrasts", "answer", "training", "robustness"}
    assert shows(made["answer"], [100 * each.value.estimate for each in results.of_task("reach")])
    declared = [100 * each.estimate for each in found if each.family == DECLARED]
    assert shows(made["contrasts"], declared)
    assert shows(made["training"], [0.4, 0.3])
    assert not shows(made["answer"], 12.345)
    for figure in made.values():
        check_texts(figure)
