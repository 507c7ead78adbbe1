"""The tables of a study, for a page in HTML and one in Markdown alike."""

import shlex
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from handrail.datasets.comparison.report import contrast_table
from handrail.datasets.presentation import wording
from handrail.datasets.presentation.table import Table
from handrail.datasets.presentation.wording import DASH, number, percent
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.statistics.contrast import Contrast
from handrail.datasets.statistics.replicates import chance_of_shares, student
from handrail.policies.study.contrasts import DECLARED, EXPLORATORY, SYSTEM
from handrail.policies.study.declared import declared
from handrail.policies.study.power import detectable
from handrail.policies.study.results import MEASURES, Results, StudyCondition

_TITLES = {
    DECLARED: "Declared before the run: policy success",
    SYSTEM: "A claim about a system, not tested: a policy and a controller, against a policy alone",
    EXPLORATORY: "Exploratory: not declared, not tested",
}


def of_contrasts(found: Sequence[Contrast], results: Results) -> list[Table]:
    """Return the tables of contrasts, a kind each, without empty ones."""
    made = [contrasts_table(found, kind, results) for kind in _TITLES]
    return [table for table in made if table.rows]


def of_task(task: str, results: Results) -> list[Table]:
    """Return the tables of a task without empty ones."""
    kinds = conditions_table, failures_table, collection_table, effort_table, quality_table
    return [table for make in (*kinds, treatments_table) if (table := make(task, results)).rows]


def contrasts_table(found: Sequence[Contrast], kind: str, results: Results) -> Table:
    """Return contrasts of a kind; of declared ones also what was planned to be detected."""
    design = results.progress.design
    columns, more = ["group", "of", "measure", "difference", "95 %", "n"], {}
    if kind == DECLARED:
        asked = declared(design) if design.draws > 1 else []
        planned = {each.label: f"{100 * detectable(design, each):.0f} points" for each in asked}
        columns += ["p", "p, Holm"]
        more["detectable, as planned"] = lambda each: planned.get(each.label, DASH)
    chosen = [each for each in found if each.family == kind]
    return contrast_table(chosen, columns, _TITLES[kind], "n: draws", more)


def conditions_table(task: str, results: Results) -> Table:
    """Return how the undisturbed policies of a task fared."""
    measures = MEASURES["contact"].title, MEASURES["clean"].title
    headings = ("policy", "success", "95 %", "each draw", *measures, "length s", "learnt from", "updates")
    rows = [_condition(each, results) for each in results.of_task(task)]
    return Table(headings, rows, "Policies, undisturbed; “intent” goes through the MPC")


def _condition(each: StudyCondition, results: Results) -> tuple[str, ...]:
    learnt = results.trained(each)
    episodes, seconds = (
        np.mean([e["trained_on"].get(name, 0.0) for e in learnt]) for name in ("episodes", "operator_time")
    )
    steps, touched = sorted(one["steps"] for one in learnt), each.rolled("contact")
    return (
        each.label,
        percent(each.value.estimate),
        wording.percent_span(each.value.interval),
        ", ".join(f"{100 * share:.0f}" for share in each.shares.values()),
        f"{touched.sum():.0f} of {len(touched)}",
        percent(float(each.rolled("clean").mean())),
        number(each.mean("length")),
        f"{episodes:.0f} episodes, {seconds / 60.0:.1f} min",
        " to ".join(map(str, sorted({steps[0], steps[-1]}))),
    )


def failures_table(task: str, results: Results) -> Table:
    """Return where the rollouts of a task failed: the furthest stage, and how it ended."""
    conditions = results.of_task(task)
    kinds = [kind for kind, _ in sum((e.failures for e in conditions), Counter[str]()).most_common()]
    rows = [
        (each.label, str(len(each.rolled())), *(str(each.failures[kind]) for kind in kinds))
        for each in conditions
    ]
    title = "Where rollouts failed: the furthest stage, and how they ended"
    return Table(("policy", "rollouts", *kinds), rows if kinds else [], title)


def collection_table(task: str, results: Results) -> Table:
    """Return what was collected, all draws of a mode together."""
    headings = ("mode", "draws", "episodes", "success", "operator time", "s a success", "successes / h")
    rows = [(kind, *_collected(each)) for kind, each in results.collected(task).items()]
    return Table((*headings, "failures"), rows, "Collecting")


def effort_table(task: str, results: Results) -> Table:
    """Return what helping a policy asks of the operator, all draws of a round together."""
    headings = ("round", "attention", "steering", "of the attention", "corrections / min", "contacts / min")
    found = results.collected(task) if results.progress.design.rounds else {}
    rows = [(kind, *_effort(each)) for kind, each in found.items()]
    return Table(headings, rows, "The operator's effort: attention is the time of whole attempts")


def _effort(found: Sequence[dict[str, Any]]) -> tuple[str, ...]:
    minutes, steered = (sum(each[name] for each in found) for name in ("minutes", "steered"))
    rates = (
        number(sum(each["quality"][name] * each["episodes"] for each in found) / minutes)
        if all(name in each["quality"] for each in found)
        else DASH
        for name in ("interventions", "contacts")
    )
    return f"{60.0 * minutes:.0f} s", f"{60.0 * steered:.0f} s", percent(steered / minutes), *rates


def _collected(found: Sequence[dict[str, Any]]) -> tuple[str, ...]:
    episodes, successes, minutes = (
        sum(each[name] for each in found) for name in ("episodes", "successes", "minutes")
    )
    reasons = sum((Counter(each["reasons"]) for each in found), Counter[str]())
    return (
        str(len(found)),
        str(episodes),
        percent(successes / episodes),
        f"{minutes:.1f} min",
        number(60.0 * minutes / successes) if successes else DASH,
        number(60.0 * successes / minutes),
        ", ".join(f"{reason} ({count})" for reason, count in reasons.most_common()) or DASH,
    )


def quality_table(task: str, results: Results) -> Table:
    """Return the quality metrics of the demonstrations: the mean over draws of the mean over episodes.

    Those that one scale, or one controller, would have to be shared for are left to `handrail-compare`.
    """
    found = results.collected(task)
    known = [metric for metric in METRICS if metric.needs not in ("scale", "controller")]
    rows, titles = [], {metric.name: metric.title for metric in known}
    for name in titles:
        values = [[each["quality"].get(name) for each in draws] for draws in found.values()]
        means = [[value for value in each if value is not None] for each in values]
        if any(means):
            shown = (number(float(np.mean(each))) if each else DASH for each in means)
            rows.append((titles[name], *shown))
    return Table(("metric", *found), rows, "The demonstrations: described, not tested")


def treatments_table(task: str, results: Results) -> Table:
    """Return disturbed and protected policies beside the same rollouts without."""
    headings = ("policy", "treatment", "success", "without it", "points", "points 95 %", "contact")
    rows = [_treatment(each, results) for each in results.of_task(task, treated=True)]
    title = "Disturbed, otherwise protected, or of fewer updates; beside the same scenes without it"
    return Table((*headings, "without it"), rows, title)


def _treatment(each: StudyCondition, results: Results) -> tuple[str, ...]:
    whole, shown, before = results.find(each.task, each.label), [DASH] * 3, DASH
    if whole and (same := whole.beside(each)):
        apart = [each.share(draw) - same.share(draw) for draw in each.draws]
        change = student(apart, chance_of_shares(each.runs()) + chance_of_shares(same.runs()))
        difference = [wording.points(change.estimate), wording.points_span(change.interval)]
        shown = [percent(float(same.rolled().mean())), *difference]
        before = percent(float(same.rolled("contact").mean()))
    touched = float(each.rolled("contact").mean())
    return each.label, each.treatment, percent(float(each.rolled().mean())), *shown, percent(touched), before


def times_table(results: Results) -> Table:
    """Return what the jobs took."""
    took: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for job, note in results.progress.notes.items():
        if spent := note.get("took"):
            kind = "train and evaluate" if job.policy else "collect"
            took.setdefault((job.cell.task, kind), []).append(spent)
    rows = [
        (
            *kind,
            str(len(each)),
            wording.duration(float(np.mean([one["seconds"] for one in each]))),
            wording.duration(sum(one["processor_seconds"] for one in each)),
            ", ".join(sorted({str(one["cores"]) for one in each})),
        )
        for kind, each in took.items()
    ]
    headings = ("task", "job", "jobs", "a job, by the clock", "all, of a core", "cores of the machine")
    return Table(headings, rows, "Cost (of a job that was interrupted: since it went on)")


def cells_table(results: Results, name: str) -> Table:
    """Return the command that runs a cell anew, and the digest of its rows."""
    notes = {job.cell.name: note for job, note in results.progress.notes.items() if not job.policy}
    rows = [(cell, note["result"]["digest"], cell_command(name, cell)) for cell, note in notes.items()]
    return Table(("cell", "digest of the rows", "command"), rows, "Any cell again")


def cell_command(name: str, cell: str) -> str:
    """Return the command that records, trains and evaluates one cell of a study anew."""
    return f"handrail-study --preset {shlex.quote(name)} --only {cell} --output outputs/again"
