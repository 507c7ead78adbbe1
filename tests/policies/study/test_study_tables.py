"""A study's tables, figures and how to read them: with rollouts that are known."""

from dataclasses import replace

from compare_helpers import check_texts
from figure_helpers import shows
from made_study import DESIGN, MODES, TASK

from handrail.policies.study import tables
from handrail.policies.study.contrasts import DECLARED, contrasts
from handrail.policies.study.design import Flat, Robustness
from handrail.policies.study.figures import figures
from handrail.policies.study.report import cautions


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
    for condition in results.of_task("reach", treated=True):
        assert set(condition.draws) == {0, 1}
        whole = results.find("reach", condition.label)
        for draw, each in condition.draws.items():
            assert set(each.rollouts) < set(whole.draws[draw].rollouts)


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


def test_failures_are_counted_by_stage(gathered):
    results = gathered()
    table = tables.failures_table("reach", results)
    assert table.headings == ("policy", "rollouts", "lift")
    for label, rollouts, count in table.rows:
        condition = results.find("reach", label)
        assert (int(rollouts), int(count)) == (80, 80 - int(condition.rolled().sum()))


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
