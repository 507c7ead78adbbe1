"""What a study says of its policies: only what was declared is tested, draws are pairs, never too much."""

import json
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from compare_helpers import check_texts
from figure_helpers import shows
from made_study import DESIGN, LABELS, MODES, SHARES, TASK
from scipy import stats

from handrail.datasets.presentation import wording
from handrail.datasets.statistics.contrast import holm
from handrail.datasets.statistics.replicates import (
    chance_of_shares,
    equivalence_p,
    equivalence_power,
    student,
)
from handrail.datasets.statistics.resampling import Run
from handrail.datasets.storage.strict_json import write_json
from handrail.policies.study import tables
from handrail.policies.study.contrasts import DECLARED, EXPLORATORY, SYSTEM, contrasts
from handrail.policies.study.declared import declared
from handrail.policies.study.design import DeclaredPair, Robustness
from handrail.policies.study.figures import figures
from handrail.policies.study.power import detectable, plan
from handrail.policies.study.progress import StudyProgress
from handrail.policies.study.report import answer, cautions
from handrail.policies.study.results import MEASURES, gather


def shares_of(results, task, label):
    return np.array(list(results.find(task, label).shares.values()))


def test_a_contrast_is_what_its_words_say_draw_by_draw(gathered):
    results = gathered()
    found = {(each.label, each.scope, each.measure.name): each for each in contrasts(results)}
    sides = zip(LABELS, (("ee", "decoupled"), ("ee same number", "direct same number")), strict=True)
    for (label, names), scope in product(sides, (("reach", "tray"), ("reach",), ("tray",))):
        one, other = (np.mean([shares_of(results, task, name) for task in scope], axis=0) for name in names)
        values, estimate = one - other, found[label, ", ".join(scope), "success"]
        assert estimate.estimate == pytest.approx(values.mean())
        assert estimate.counts == (4,)
        by_scipy: Any = stats.ttest_1samp(values, 0.0)
        wider = estimate.errors[0][0] >= values.std(ddof=1) / 2 - 1e-12
        assert wider
        if estimate.errors[0][0] == pytest.approx(values.std(ddof=1) / 2):
            if estimate.family == DECLARED:
                assert estimate.p == pytest.approx(by_scipy.pvalue)
            interval = by_scipy.confidence_interval()
            assert estimate.interval == pytest.approx((interval.low, interval.high))


def test_only_what_is_declared_is_tested_over_all_tasks(gathered):
    found: Any = contrasts(gathered())
    declared = [each for each in found if each.family == DECLARED]
    assert [each.label for each in declared] == LABELS
    assert all(each.scope == "reach, tray" for each in declared)
    assert [each.p_adjusted for each in declared] == holm([each.p for each in declared])
    others = [each for each in found if each.family != DECLARED]
    assert {(label, scope) for label in LABELS for scope in ("reach", "tray")} <= {
        (each.label, each.scope) for each in others
    }
    assert all(each.p_adjusted is None and not each.detected for each in others)
    fewer: Any = contrasts(gathered(replace(DESIGN, pairs=(DeclaredPair("ee", "direct"),))))
    assert fewer[0].family == DECLARED
    assert fewer[0].p_adjusted == fewer[0].p
    names = [(each.label, each.scope, each.measure.name) for each in fewer]
    assert len({*names}) == len(names)  # what is compared with the baseline anyway is not there twice


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
    results = gathered(missing=lambda job: job.cell.name == "tray/decoupled/2")
    found = {(e.label, e.scope): e for e in contrasts(results) if e.measure is MEASURES["success"]}
    assert found[LABELS[0], "reach, tray"].counts == (3,)
    assert found[LABELS[0], "reach"].counts == (4,)
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


@pytest.mark.parametrize("label", LABELS)
def test_the_planned_difference_is_detected_in_four_of_five_studies(label):
    """Policies drawn with the design's spread and the worst rollouts, an effect as large as planned for."""
    rng, found, studies = np.random.default_rng(3), 0, 2000
    design = replace(DESIGN, draws=8, rollouts=50)
    (asked,) = (each for each in declared(design) if each.label == label)
    effect = detectable(design, asked)
    for _ in range(studies):
        values = np.zeros(8)
        for weight in asked.parts.values():
            success = 0.5 + effect * weight / 2 + rng.normal(0.0, asked.sd, (2, 8))
            shares = rng.binomial(50, np.clip(success, 0.0, 1.0)) / 50
            values += weight * shares.mean(axis=0)
        estimate: Any = student(values, least=0.0)
        found += estimate.p < 0.05 / 2
    assert found / studies == pytest.approx(0.8, abs=0.06)


def test_a_pair_with_a_margin_is_tested_for_equivalence(gathered):
    results = gathered()
    found: Any = contrasts(results)
    said = answer(found, DESIGN)
    assert said[0].startswith("ee − decoupled")
    assert "Equivalence of ee − decoupled within 10 points: not shown" in said[-1]
    like = gathered(shares=dict.fromkeys(SHARES, (0.95, 0.9, 1.0, 0.9)))
    assert "within 10 points: shown, p = 0.0" in answer(contrasts(like), DESIGN)[-1]
    text = plan(DESIGN)
    assert "Declared: ee − decoupled, ee − direct (same number), over reach, tray together." in text
    assert "Of ee − decoupled equivalence is declared too" in text
    assert str(tables.contrasts_table(found, DECLARED, results).rows[0][-1]).endswith("points")


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
    better = {label: (0.95 if label == "ee same number" else 0.3,) * 4 for label in SHARES}
    found = contrasts(gathered(shares=better))
    said = answer(found, DESIGN)
    assert [each.label for each in found if each.detected] == LABELS[1:]
    assert [sentence.partition(":")[0] for sentence in said[:2]] == LABELS
    assert [", a difference detected." in sentence for sentence in said[:2]] == [False, True]
    assert [", no difference detected." in sentence for sentence in said[:2]] == [True, False]
    values = {each.label: each.estimate for each in found if each.family == DECLARED}
    assert f"{100 * values[LABELS[1]]:+.0f} points (95 %" in said[1]
    nothing = answer(contrasts(gathered(shares=dict.fromkeys(SHARES, (0.5,) * 4))), DESIGN)
    assert all("no difference detected" in sentence for sentence in nothing[:2])


def test_with_nothing_declared_or_with_one_draw_nothing_is_claimed(gathered):
    plain = gathered(replace(DESIGN, pairs=()))
    found = contrasts(plain)
    assert {each.family for each in found} == {EXPLORATORY, SYSTEM}
    assert {"ee − direct", "ee − direct (same number)"} <= {each.label for each in found}
    assert all(each.p_adjusted is None for each in found)
    assert "No contrast was declared" in answer(found, plain.progress.design)[0]
    assert "Nothing is declared" in plan(plain.progress.design)
    single = gathered(replace(DESIGN, draws=1, beside=None))
    found = contrasts(single)
    assert all(each.interval is None and each.p_adjusted is None for each in found)
    assert "one draw tests nothing" in answer(found, single.progress.design)[0]
    assert any("One draw" in text for text, holds in cautions(single).items() if holds)
    assert tables.contrasts_table(found, DECLARED, single).rows


def test_a_share_of_few_is_never_certain():
    assert chance_of_shares([Run(0, 0, tuple(range(50)), np.zeros(50))]) > 0.0
    assert student([0.5], least=0.0).interval is None
    assert json.dumps(student([0.5, 0.7], least=0.0).estimate)


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
    assert made.keys() == {"contrasts", "answer", "robustness"}
    assert shows(made["answer"], [100 * each.value.estimate for each in results.of_task("reach")])
    declared = [100 * each.estimate for each in found if each.family == DECLARED]
    assert shows(made["contrasts"], declared)
    assert not shows(made["answer"], 12.345)
    for figure in made.values():
        check_texts(figure)


def test_metrics_without_a_common_scale_are_left_to_compare(gathered):
    """Each recording is measured by itself: a share of its own largest command says nothing of others."""
    rows = tables.quality_table("reach", gathered()).rows
    assert [row[0] for row in rows] == ["episode length", "smoothness (SPARC)", "contacts", "interventions"]


def test_jobs_that_ran_under_other_versions_are_said(gathered):
    made = gathered().progress
    for job, version, said in zip(made.jobs, ("4.0.0", "4.0.0", "4.0.1"), (0, 0, 1), strict=False):
        note = made.notes[job]
        write_json(made.layout.done(job), note | {"took": note["took"] | {"versions": {"mujoco": version}}})
        results = gather(StudyProgress(made.design, made.layout))
        assert sum("other versions" in text for text, holds in cautions(results).items() if holds) == said
