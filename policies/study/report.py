"""What a study writes: a page for people, JSON for programs, and its part of a Markdown page."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from handrail.controllers.versions import SIMULATION, versions
from handrail.datasets.comparison.report import report_json, write_report
from handrail.datasets.presentation import markup
from handrail.datasets.presentation.drawing import png, svg
from handrail.datasets.presentation.markdown import markdown_table, write_part
from handrail.datasets.presentation.table import Table
from handrail.datasets.presentation.wording import points, points_span
from handrail.datasets.statistics.contrast import Contrast
from handrail.datasets.storage.atomic import explained, write_whole
from handrail.policies.imitation.training.plateau import Plateau
from handrail.policies.study import tables
from handrail.policies.study.config import StudyConfig
from handrail.policies.study.contrasts import DECLARED, EXPLORATORY, SYSTEM, WORDS, contrasts
from handrail.policies.study.design import StudyDesign
from handrail.policies.study.figures import figures
from handrail.policies.study.power import plan
from handrail.policies.study.progress import StudyProgress, designs
from handrail.policies.study.results import Results, gather

_UNDECLARED = "No contrast was declared before the run: what is shown explores, and nothing is tested."
_TOO_EARLY = "No draw has all cells of the 2 × 2 on all tasks yet: nothing can be said."
_LIMITS = (
    "Measured with scripted operators, one simulated robot and one learner: it says nothing of people or"
    " of other learners."
)
_ONE_DRAW = "One draw does not say how much another recording would differ."
_MISSING = "{} of {} jobs are not done yet: study.json names them."
_CHANGED = "The design was changed after the study began. Digests, in order: {}; this report is of {}."
_AGAIN = "Recorded again, and the rows were others than before: {}."
_CAPPED = "Policies that ended with the most updates that there might be, before their loss was flat: {}."
_HOW = (
    "A draw is a fresh recording (other scenes, other scripted persons), one training seed and beginnings"
    " of its own; it is the same for all modes, so draws are pairs. Every mode got the same operator time,"
    " failed attempts included: that is not the same number of demonstrations. The metrics are of all that"
    " was recorded, failures included. With [flat] in the design each policy was trained until its loss on"
    " held-out episodes fell no longer, which does not show that success would rise no longer; without it"
    " every policy got the same number of updates, and whether its loss was flat by then is not known. The"
    " last checkpoint counts. Policies write joint velocities, which go to the robot unprotected. “Intent”"
    " is another thing: the policy writes the operator's command, and the MPC completes it and keeps it"
    " safe when the policy drives, too. Intervals are 95 %: Student's t over draws, where a draw varies at"
    " least as its rollouts do; with one draw Wilson's, of these very policies. Contrasts are taken within"
    " each draw; several tasks count alike. Only declared contrasts are tested, p after Holm over these."
    " All others explore. No interval is adjusted: with so many contrasts some leave out zero by chance. A"
    " system claim compares a policy and a controller with a policy alone, the best of the unprotected ones"
    " in this very measure, chosen afterwards, which is in its favour. It does not tell whether the intent"
    " or the MPC does it."
)


_CAPTIONS = {
    "contrasts": "What makes a difference: declared, over all tasks (dark), and in each task (grey).",
    "answer": "Success of the policies; lines: 95 %, ticks: draws. Round: joint velocities, unprotected;"
    " diamonds: intent through the MPC, policy and controller;"
    " squares: the same number of demonstrations.",
    "training": "Loss on held-out episodes while the policies learnt; a dot is where the training ended.",
    "robustness": "Success disturbed and undisturbed.",
}
_FORMAT = "handrail.study/4"
_OF_TASK = (
    tables.conditions_table,
    tables.failures_table,
    tables.collection_table,
    tables.quality_table,
    tables.treatments_table,
)


def write_study(config: StudyConfig, progress: StudyProgress) -> list[Path]:
    """Write report.html, study.json, differences.csv, and the part of a Markdown page if asked.

    Args:
        config: Says whether there is a page.
        progress: Of the study: only what is done is reported, and it says how much is not.
    """
    results = gather(progress)
    found = contrasts(results)
    drawn, content = figures(results, found), _content(config, results, found)
    html = _html(config, results, found, drawn)
    written = write_report(progress.layout.root, html, content, found, {}, name="study.json")
    if config.page:
        with explained(f"--page {config.page}"):
            written += _write_page(config, results, found, drawn, content)
    return written


def _of_all(results: Results, found: Sequence[Contrast]) -> list[Table]:
    made = [tables.contrasts_table(found, kind, results) for kind in (DECLARED, SYSTEM, EXPLORATORY)]
    return [table for table in made if table.rows]


def _of_task(task: str, results: Results) -> list[Table]:
    return [table for make in _OF_TASK if (table := make(task, results)).rows]


def _html(config: StudyConfig, results: Results, found: Sequence[Contrast], drawn: Mapping[str, Any]) -> str:
    design = results.progress.design
    first, *others = answer(found, design)
    told = [("", text) for text in others] + [("caution", text) for text in cautions(results)]
    pictures = [(_CAPTIONS[name], "", svg(figure)) for name, figure in drawn.items()]
    again = tables.times_table(results), tables.cells_table(results, config.preset)
    of_all = _of_all(results, found)
    return markup.page(
        f"Study {design.name}: {', '.join(design.modes)}",
        markup.paragraph(first, "headline"),
        markup.items(told),
        markup.section("Figures", markup.panels(pictures, "wide")) if pictures else "",
        markup.section("Contrasts", *of_all) if of_all else "",
        *(markup.section(_title(task), *_of_task(task, results)) for task in design.tasks),
        markup.section("How to read this", markup.paragraph(how(design))),
        markup.section("Again", *(table for table in again if table.rows)),
    )


def _title(task: str) -> str:
    return task.replace("_", " ").capitalize()


def _content(config: StudyConfig, results: Results, found: Sequence[Contrast]) -> dict[str, Any]:
    progress = results.progress
    done = {job.name: note for job in progress.jobs if (note := progress.note(job))}
    took = [note.get("took", {}) for note in done.values()]
    return {
        "format": _FORMAT,
        "design": asdict(progress.design),
        "designs": designs(progress.layout),
        "missing": progress.missing,
        "versions": versions(*SIMULATION, "torch"),
        "answer": answer(found, progress.design),
        "conditions": [each.content for each in results.conditions.values()],
        "jobs": {name: {"result": note["result"], "took": note.get("took")} for name, note in done.items()},
        "seconds": sum(each.get("seconds", 0.0) for each in took),
        "processor_seconds": sum(each.get("processor_seconds", 0.0) for each in took),
        "again": tables.cell_command(config.preset, "TASK/MODE/DRAW"),
    }


def _write_page(
    config: StudyConfig,
    results: Results,
    found: Sequence[Contrast],
    drawn: Mapping[str, Any],
    content: Mapping[str, Any],
) -> list[Path]:
    """Put tables and figures between the study's marks; figures and JSON go beside the page."""
    design, page = results.progress.design, Path(config.page).expanduser()
    stem = f"{page.stem}_{design.name}"
    parts = ["\n".join(f"- {text}" for text in (*answer(found, design), *cautions(results)))]
    data = page.parent / f"{stem}.json"
    written = [page, data]
    for name, figure in drawn.items():
        picture = page.parent / f"{stem}_{name}.png"
        write_whole(picture, png(figure))
        parts.append(f"![{_CAPTIONS[name]}]({picture.name})")
        written.append(picture)
    parts += map(markdown_table, _of_all(results, found))
    for task in design.tasks:
        if of_task := _of_task(task, results):
            parts += [f"### {_title(task)}", *map(markdown_table, of_task)]
    parts += ["### How to read this", how(design)]
    times = tables.times_table(results)
    parts += [markdown_table(times)] if times.rows else []
    again = tables.cell_command(config.preset, "TASK/MODE/DRAW")
    parts.append(
        f"`handrail-study --preset {config.preset}` wrote this, design `{design.digest}`. `{again}` runs one"
        " cell anew, with the same rows and the same rollouts; digests are in the JSON."
    )
    write_whole(data, report_json(content, found).encode())
    write_part(page, "Teleoperation modes", f"study {design.name}", "\n\n".join(filter(None, parts)))
    return written


def answer(found: Sequence[Contrast], design: StudyDesign) -> list[str]:
    """Return the headline, a sentence each: the interaction first, as means over what differs mislead."""
    declared = {each.label: each for each in found if each.family == DECLARED}
    if declared:
        return [_said(declared[name]) for name in reversed(WORDS.values()) if name in declared]
    return [_TOO_EARLY if design.factors and design.factors.primary else _UNDECLARED]


def _said(each: Contrast) -> str:
    name, interval = f"{each.label[:1].upper()}{each.label[1:]}", each.interval
    if interval is None:
        return f"{name}: {points(each.estimate)} points; one draw tests nothing."
    seen = f"{'a' if each.detected else 'no'} difference detected"
    verdict = "not tested before all draws are done" if each.p_adjusted is None else seen
    return f"{name}: {points(each.estimate)} points (95 % {points_span(interval)}), {verdict}."


def how(design: StudyDesign) -> str:
    """Return the paragraph: what was drawn, trained and tested, and what that can detect."""
    return f"{_HOW} {plan(design)}"


def cautions(results: Results) -> list[str]:
    """Return what stands in the way of reading the results as they are meant."""
    progress, design = results.progress, results.progress.design
    seen = [each["digest"] for each in designs(progress.layout)]
    notes = {job.cell.name: progress.note(job) for job in progress.jobs if job.policy is None}
    again = [name for name, note in notes.items() if "digest_before" in note.get("result", {})]
    capped = sum(
        _capped(each, design, condition.task)
        for condition in results.conditions.values()
        if not condition.treatment
        for each in results.trained(condition)
    )
    known = {
        _LIMITS: True,
        _ONE_DRAW: design.draws < 2,
        _MISSING.format(len(progress.missing), len(progress.jobs)): bool(progress.missing),
        _CHANGED.format(", ".join(seen), design.digest): bool({*seen} - {design.digest}),
        _AGAIN.format(", ".join(again)): bool(again),
        _CAPPED.format(capped): capped > 0,
    }
    return [text for text, holds in known.items() if holds]


def _capped(result: Mapping[str, Any], design: StudyDesign, task: str) -> bool:
    """Return whether a training ended before its loss was flat."""
    flat = design.flat
    if flat is None:
        return False
    losses = {int(step): loss for step, loss in result.get("validation", {}).items()}
    return Plateau(losses, flat.patience, flat.improvement, design.tasks[task].steps, 0).flat is None
