"""What a study says of its policies: like for like first, beside the same rollouts, and never too much."""

from dataclasses import replace

import numpy as np
import pytest
from compare_helpers import check_texts
from figure_helpers import shows

from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.collection import Collected
from handrail.datasets.comparison.evaluations import Condition, Policy
from handrail.datasets.comparison.outcomes import LIKE_FOR_LIKE
from handrail.datasets.statistics.proportions import holm
from handrail.policies.study.design.design import Robustness, StudyDesign, Sweep, TaskDesign
from handrail.policies.study.design.jobs import jobs
from handrail.policies.study.report import gather as studied
from handrail.policies.study.report.conditions import CONTROLLER, PROTECTED, identify
from handrail.policies.study.report.figures import by_treatment, figures
from handrail.policies.study.report.how import how
from handrail.policies.study.report.tables import tables

FAMILIES = (LIKE_FOR_LIKE, CONTROLLER, PROTECTED)
TASK = TaskDesign(episodes=5, minutes=1.0, steps=10)
DESIGN = StudyDesign("made", ("ee", "direct"), {"reach": TASK}, "direct", seeds=(0, 1, 2), rollouts=40)
ROBUST = replace(DESIGN, robustness=Robustness(perturbations=("push",), rollouts=15))


def arm(label, share, seeds, scenes, trained_on=None):
    """Policies whose scenes are those that every arm meets, some of them hard for all."""
    found = []
    for seed in seeds:
        luck = np.random.default_rng([seed, *label.encode()]).random(scenes)
        rollouts = {k: {"success": float(luck[k] < share), "contacts": k % 2} for k in range(scenes)}
        found.append(Policy(0, seed, trained_on or {"episodes": 5.0}, rollouts))
    return Condition(label, tuple(found))


@pytest.fixture
def gathered(monkeypatch):
    """Return what a study would gather if its jobs had left made-up rollouts; some may be missing."""

    def made(design, task, what, noise):
        found = {}
        for job in jobs(design):
            own = job.policy
            if own and (own.cell.task, own.cell.noise) == (task, noise) and (what == "nominal" or job.robust):
                ending = {"nominal": "", "disturbed": " pushed", "protected": " filter"}[what]
                if what != "protected" or own.actions == "realised":
                    scenes = design.rollouts if what == "nominal" else design.robustness.rollouts
                    share = 0.9 if own.cell.mode == "ee" else 0.3
                    seeds = found.setdefault(own.label + ending, (share, [], scenes))[1]
                    seeds.append(own.seed)
        return {label: arm(label, share, seeds, scenes) for label, (share, seeds, scenes) in found.items()}

    def gather(design, missing=()):
        def read(design, _, task, what, noise=1.0):
            return {k: v for k, v in made(design, task, what, noise).items() if k not in missing}

        monkeypatch.setattr(studied, "read_conditions", read)
        monkeypatch.setattr(
            studied, "read_collected", lambda _, cell: Collected(cell.mode, 10, 9, (0.6, 1.0), 90.0, 900, {})
        )
        rng = np.random.default_rng(0)
        found = [studied.task_results(task, design, None, rng) for task in design.tasks]  # type: ignore[arg-type]
        return studied.in_words(found, design)

    return gather


def pairs(outcomes):
    return [(each.label, each.baseline) for each in outcomes.differences]


def test_every_budget_has_its_own_baseline(gathered):
    (both,) = gathered(replace(DESIGN, budgets=("time", "number")))
    assert pairs(both.policies) == [
        ("ee", "direct"),
        ("ee intent", "direct"),
        ("ee same number", "direct same number"),
        ("ee intent same number", "direct same number"),
    ]
    (number,) = gathered(replace(DESIGN, budgets=("number",), sweep=Sweep(("reach",), (0.0,), (0, 1))))
    assert pairs(number.policies) == pairs(both.policies)[2:]
    assert set(number.sweep) == {"ee same number", "ee intent same number", "direct same number"}


def test_without_the_baseline_nothing_is_compared(gathered):
    (found,) = gathered(DESIGN, missing=("direct",))
    assert pairs(found.policies) == []
    assert found.answer == ""
    (said,) = found.findings
    assert said.kind == "caution"
    assert "Compared with nothing: ee, ee intent; there is no policy" in said.text


def test_an_arm_of_another_study_is_refused():
    with pytest.raises(
        HandrailError, match="unknown condition of the evaluations 'leader': expected one of direct"
    ):
        identify(DESIGN, ["ee", "leader"])


def test_like_for_like_comes_first_and_a_controller_is_named(gathered):
    (found,) = gathered(ROBUST)
    texts = [each.text for each in found.findings if each.kind == "outcome"]
    starts = [
        "Like for like, joint velocities, unprotected: ",
        "Like for like, joint velocities, both through the filter: ",
        "Policy plus controller, intent through the MPC against joint velocities, unprotected: ",
    ]
    assert [text.startswith(start) for text, start in zip(texts, starts, strict=True)] == [True] * 3
    assert [found.answer.index(start) for start in starts] == sorted(map(found.answer.index, starts))
    assert pairs(found.shielded) == [("ee filter", "direct filter")]
    (table,) = [each for each in tables(found) if each.title == "Differences"]
    assert [str(row[5]).partition("\n")[2] for row in table.rows] == [
        "over 1 like-for-like difference",
        "over 1 protected difference",
        "over 1 policy-plus-controller difference",
    ]


def test_cautions_are_said(gathered):
    design = replace(ROBUST, seeds=(0,))
    (found,) = gathered(design)
    cautions = " ".join(each.text for each in found.findings if each.kind == "caution")
    assert "Fewer than 3 training seeds (ee, direct, ee intent)" in cautions
    assert "Fewer than 3 training seeds (ee filter, direct filter)" in cautions
    assert cautions.count("One draw of each dataset") == 1


def test_a_family_is_one_kind_of_comparison_over_all_tasks(gathered):
    """A policy plus a controller is another question than the data: it changes no verdict on these."""
    several = gathered(replace(ROBUST, tasks={"reach": TASK, "tray": TASK}))
    found = [each for task in several for each in (*task.policies.differences, *task.shielded.differences)]
    families = {family: [each for each in found if each.family == family] for family in FAMILIES}
    assert sum(map(len, families.values())) == len(found) == 6
    for members in families.values():
        assert {each.tests for each in members} == {2}
        assert [each.p_adjusted for each in members] == holm([each.p for each in members])
    assert {each.label for each in families[CONTROLLER]} == {"ee intent"}
    assert all("over 2 like-for-like differences" in task.findings[0].text for task in several)


def test_undisturbed_beside_disturbed_is_the_same_policies_in_the_same_scenes(gathered):
    (found,) = gathered(ROBUST)
    assert found.undisturbed["ee"].outcome.rollouts == 120
    for each in (*found.disturbed.values(), *found.protected.values()):
        assert each.without.rollouts == each.outcome.rollouts == 15
        share = 0.9 if each.condition.mode == "ee" else 0.3
        values = arm(each.condition.label, share, [0], 40).runs()[0].values[:15]
        assert each.without.seeds == (values.mean(),)
        assert (each.change.paired, each.change.trials) == (True, (15,))
        assert each.change.estimate == pytest.approx(each.outcome.share - each.without.share)
    pushed = found.disturbed["ee pushed"]
    shown = by_treatment(found, found.undisturbed["ee"].condition)
    assert shown == {"undisturbed": pushed.without, "pushed": pushed.outcome}


def test_a_condition_that_some_scenes_lack_stands_alone(gathered):
    (found,) = gathered(ROBUST, missing=("ee",))
    assert found.disturbed["ee pushed"].without is None
    assert found.disturbed["direct pushed"].without is not None
    assert figures(ROBUST, [found]).keys() == {"answer", "robustness"}


def test_every_level_of_noise_has_the_same_training_seeds(gathered):
    (found,) = gathered(replace(DESIGN, sweep=Sweep(("reach",), (0.0, 2.0), (0, 1))))
    for points in found.sweep.values():
        assert [point.noise for point in points] == [0.0, 1.0, 2.0]
        assert {len(point.outcome.seeds) for point in points} == {2}


def test_how_to_read_it_says_what_was_done(gathered):
    several, one = ROBUST, replace(ROBUST, seeds=(0,))
    said = how(several, gathered(several))
    for words in (
        "same operator time",
        "Welch",
        "McNemar",
        "1 like-for-like difference, 1 policy-plus-controller difference and 1 protected difference",
        "ee against direct: what the operator steers and the controller differ at once",
        "Student's t",
        "mode ee",
        "“With training”",
    ):
        assert words in said
    assert "Boschloo" not in said
    said = how(one, gathered(one))
    assert "Welch" not in said
    assert "There is one training seed" in said
    number = replace(DESIGN, modes=("leader", "direct"), budgets=("number",))
    said = how(number, gathered(number))
    assert "same number of successful demonstrations" in said
    assert "differ at once" not in said  # no MPC behind either
    assert not any(
        words in said for words in ("operator time", "the MPC", "mode ee", "protection", "Without")
    )
    empty = how(DESIGN, gathered(DESIGN, missing=("ee", "direct", "ee intent")))
    assert not any(words in empty for words in ("Holm", "Intervals", "McNemar"))


def test_figures_show_what_was_found(gathered):
    design = replace(ROBUST, sweep=Sweep(tuple(ROBUST.tasks), (0.0, 2.0), (0, 1)))
    (found,) = gathered(design)
    made = figures(design, [found])
    shares = [100 * each.outcome.share for each in found.undisturbed.values()]
    assert len(set(shares)) > 1
    assert shows(made["answer"], shares)
    assert shows(made["robustness"], [100 * each.outcome.share for each in found.disturbed.values()])
    points = [point for line in found.sweep.values() for point in line]
    assert shows(made["sweep"], [100 * point.outcome.share for point in points])
    assert shows(made["sweep"], [point.seconds for point in points])
    assert not shows(made["answer"], 12.345)


def test_no_text_of_a_figure_covers_another(gathered):
    names = ("reach", "tray", "pick_place", "drawer")
    both = {"modes": ("ee", "direct", "leader"), "budgets": ("time", "number")}
    design = replace(
        ROBUST, tasks=dict.fromkeys(names, TASK), sweep=Sweep(names[:2], (0.0, 2.0), (0, 1)), **both
    )
    robust = replace(design, robustness=Robustness(("push", "shift", "delay"), rollouts=15))
    made = figures(robust, gathered(robust))
    assert made.keys() == {"answer", "robustness", "sweep"}
    for figure in made.values():
        check_texts(figure)
