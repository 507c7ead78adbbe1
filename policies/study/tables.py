"""The tables of a study, for a page in HTML and one in Markdown alike."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from handrail.datasets.comparison.policies import compare_rollouts
from handrail.datasets.comparison.report import contrast_table
from handrail.datasets.presentation.table import Table
from handrail.datasets.presentation.wording import (
    DASH,
    duration,
    number,
    percent,
    percent_span,
    points,
    points_span,
)
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.statistics.contrast import Contrast
from handrail.policies.study.contrasts import CONTRASTS, DECLARED, EXPLORATORY, SYSTEM, WORDS
from handrail.policies.study.power import detectable
from handrail.policies.study.results import MEASURES, Results, StudyCondition

_TITLES = {
    DECLARED: "Declared before the run: policy success",
    EXPLORATORY: "Exploratory: not declared, not tested",
    SYSTEM: "A claim about a system, not tested: a policy and a controller, against a policy alone",
}


def contrasts_table(found: Sequence[Contrast], kind: str, results: Results) -> Table:
    """Return contrasts of a kind; of declared ones also what was planned to be detected."""
    design = results.progress.design
    columns, more = ["group", "of", "measure", "difference", "95 %", "n"], {}
    if kind == DECLARED:
        planned = {
            WORDS[name]: f"{100 * detectable(design, name):.0f} points"
            for name in CONTRASTS
            if design.factors and design.draws > 1
        }
        columns += ["p", "p, Holm", "detectable"]
        more["detectable, as planned"] = lambda each: planned.get(each.label, DASH)
    chosen = [each for each in found if each.family == kind]
    caption = "n: draws" + ("; detectable: from the spread seen" if more else "")
    return contrast_table(chosen, columns, _TITLES[kind], caption, more)


def conditions_table(task: str, results: Results) -> Table:
    """Return how the undisturbed policies of a task fared."""
    headings = (
        "policy",
        "success",
        "95 %",
        "each draw",
        MEASURES["contact"].title,
        MEASURES["clean"].title,
        "length s",
        "learnt from",
        "updates",
    )
    rows = [_condition(each, results) for each in results.of_task(task)]
    return Table(headings, rows, "Policies, undisturbed; “intent” goes through the MPC")


def _condition(each: StudyCondition, results: Results) -> tuple[str, ...]:
    learnt = results.trained(each)
    episodes = [one["trained_on"].get("episodes", 0.0) for one in learnt]
    held = [one["trained_on"].get("held_out", 0.0) for one in learnt]
    minutes = [one["trained_on"].get("operator_time", 0.0) / 60.0 for one in learnt]
    steps, touched = sorted(one["steps"] for one in learnt), each.rolled("contact")
    return (
        each.label,
        percent(each.success.estimate),
        percent_span(each.interval),
        ", ".join(f"{100 * share:.0f}" for share in each.shares.values()),
        f"{touched.sum():.0f} of {len(touched)}",
        percent(float(each.rolled("clean").mean())),
        number(each.mean("length")),
        f"{np.mean(episodes):.0f} episodes + {np.mean(held):.0f} held out, {np.mean(minutes):.1f} min",
        f"{steps[0]}" if steps[0] == steps[-1] else f"{steps[0]} to {steps[-1]}",
    )


def failures_table(task: str, results: Results) -> Table:
    """Return where the rollouts of a task failed: the furthest stage, and how it ended."""
    conditions = results.of_task(task)
    total = sum((each.failures for each in conditions), Counter[str]())
    kinds = [kind for kind, _ in total.most_common()]
    rows = [
        (each.label, str(len(each.rolled())), *(str(each.failures[kind]) for kind in kinds))
        for each in conditions
    ]
    title = "Where rollouts failed: the furthest stage, and how they ended"
    return Table(("policy", "rollouts", *kinds), rows if kinds else [], title)


def collection_table(task: str, results: Results) -> Table:
    """Return what was collected, all draws of a mode together."""
    headings = (
        "mode", "draws", "episodes", "success", "operator time", "s a success", "successes / h", "failures",
    )  # fmt: skip
    rows = []
    for mode in results.progress.design.modes:
        found = results.collected(task, mode)
        if found:
            rows.append((mode, str(len(found)), *_collected(found)))
    return Table(headings, rows, "Collecting")


def _collected(found: Sequence[dict[str, Any]]) -> tuple[str, ...]:
    episodes, successes = (sum(each[name] for each in found) for name in ("episodes", "successes"))
    minutes = sum(each["minutes"] for each in found)
    reasons = sum((Counter(each["reasons"]) for each in found), Counter[str]())
    return (
        str(episodes),
        percent(successes / episodes),
        f"{minutes:.1f} min",
        number(60.0 * minutes / successes) if successes else DASH,
        number(60.0 * successes / minutes),
        ", ".join(f"{reason} ({count})" for reason, count in reasons.most_common()) or DASH,
    )


def quality_table(task: str, results: Results) -> Table:
    """Return the quality metrics of the demonstrations: the mean over draws of the mean over episodes."""
    modes = [mode for mode in results.progress.design.modes if results.collected(task, mode)]
    found = [[_described(each) for each in results.collected(task, mode)] for mode in modes]
    names = dict.fromkeys(name for draws in found for each in draws for name in each)
    rows = []
    for name in names:
        means = [[each[name] for each in draws if name in each] for draws in found]
        rows.append((name, *(number(float(np.mean(each))) if each else DASH for each in means)))
    return Table(("metric", *modes), rows, "The demonstrations: described, not tested")


def _described(result: dict[str, Any]) -> dict[str, float]:
    """Return the metrics of a draw by title."""
    known = {metric.title: result["quality"].get(metric.name) for metric in METRICS}
    return {title: value for title, value in known.items() if value is not None}


def treatments_table(task: str, results: Results) -> Table:
    """Return disturbed and protected policies beside the same rollouts without."""
    headings = (
        "policy", "treatment", "success", "without it", "points", "points 95 %", "contact", "without it",
    )  # fmt: skip
    rows = [_treatment(each, results) for each in results.of_task(task, treated=True)]
    title = "Disturbed, or otherwise protected; beside the same policies in the same scenes without it"
    return Table(headings, rows, title)


def _treatment(each: StudyCondition, results: Results) -> tuple[str, ...]:
    whole, shown, before = results.find(each.task, each.label), [DASH] * 3, DASH
    if whole and (same := whole.beside(each)):
        change = compare_rollouts(each.runs(), same.runs())
        shown = [percent(float(same.rolled().mean())), points(change.estimate), points_span(change.interval)]
        before = percent(float(same.rolled("contact").mean()))
    touched = float(each.rolled("contact").mean())
    return each.label, each.treatment, percent(float(each.rolled().mean())), *shown, percent(touched), before


def times_table(results: Results) -> Table:
    """Return what the jobs took."""
    took: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for job in results.progress.jobs:
        note = results.progress.note(job)
        if note.get("took"):
            kind = "train and evaluate" if job.policy else "collect"
            took.setdefault((job.cell.task, kind), []).append(note["took"])
    rows = [
        (
            task,
            kind,
            str(len(each)),
            duration(float(np.mean([one["seconds"] for one in each]))),
            duration(sum(one["processor_seconds"] for one in each)),
            ", ".join(sorted({str(one["cores"]) for one in each})),
        )
        for (task, kind), each in took.items()
    ]
    headings = ("task", "job", "jobs", "a job, by the clock", "all, of a core", "cores of the machine")
    return Table(headings, rows, "What it took (of a job that was interrupted: since it went on)")


def cells_table(results: Results, name: str) -> Table:
    """Return the command that runs a cell anew, and the digest of its rows."""
    rows, seen = [], set[str]()
    for job in results.progress.jobs:
        note = results.progress.note(job)
        if job.policy is None and note and job.cell.name not in seen:
            seen.add(job.cell.name)
            rows.append((job.cell.name, note["result"]["digest"], cell_command(name, job.cell.name)))
    return Table(("cell", "digest of the rows", "command"), rows, "Any cell again")


def cell_command(name: str, cell: str) -> str:
    """Return the command that records, trains and evaluates one cell of a study anew."""
    return f"handrail-study --preset {name} --only {cell} --output outputs/again"
