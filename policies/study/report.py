"""The report of a study: a page for people, JSON for programs, and its part of a Markdown page."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from handrail.controllers.versions import SIMULATION, versions
from handrail.datasets.comparison.report import Report, sentence
from handrail.datasets.presentation.drawing import png, svg
from handrail.datasets.presentation.markdown import markdown_table, write_part
from handrail.datasets.presentation.markup import panels
from handrail.datasets.presentation.table import Table
from handrail.datasets.presentation.wording import p_value, percent
from handrail.datasets.statistics.contrast import LEVEL, Contrast
from handrail.datasets.statistics.replicates import equivalence_p
from handrail.datasets.storage.atomic import explained, write_whole
from handrail.policies.study import tables
from handrail.policies.study.config import StudyConfig
from handrail.policies.study.contrasts import DECLARED, contrasts
from handrail.policies.study.declared import Declared, declared
from handrail.policies.study.design import StudyDesign
from handrail.policies.study.figures import CAPTIONS, figures
from handrail.policies.study.power import plan
from handrail.policies.study.progress import StudyProgress, designs
from handrail.policies.study.results import Results, gather

_LIMITS = (
    "Measured with scripted operators, one simulated robot and one learner: it says nothing of people or"
    " of other learners."
)
_EXPLORES = (
    " Contrasts are taken within each draw; several tasks count alike. Only declared contrasts are tested,"
    " p after Holm over these; all others explore, and no interval is adjusted."
)
_HOW = (
    "A draw is a fresh recording (other scenes, other scripted persons), one training seed and beginnings"
    " of its own; it is the same for all modes, so draws are pairs. Every mode got the same operator time,"
    " failed attempts included; “same number” is of demonstrations instead."
    " Every policy got the same updates. Policies write joint velocities, which go to the robot"
    " unprotected; an “intent” is the operator's command, which the MPC completes when"
    " the policy drives, too. Intervals are 95 %: Student's t over draws, where a draw varies at least as its"
    " rollouts do; with one draw Wilson's, of these very policies."
    f"{_EXPLORES} A system claim compares a policy and a controller with the best"
    " of the unprotected policies in this very measure, chosen afterwards, which favours that policy."
)
_HOW_ROUNDS = (
    "A draw is a fresh recording (other scenes, other scripted persons), one training seed and beginnings"
    " of its own for the rollouts; it is the same for all ways, so draws are pairs. All begin with the same"
    " policy. Then every way gets the same operator time, attention included: the length of whole attempts,"
    " failed ones too. After each round a policy learns from nothing, from all successful episodes of its way"
    " so far, in the same number of updates, and is measured alone: it writes the operator's intent, which"
    " the MPC completes. Intervals are 95 %: Student's t over draws; with one draw Wilson's."
    f"{_EXPLORES}"
)
_FORMAT = "handrail.study/5"


def write_study(config: StudyConfig, progress: StudyProgress) -> list[Path]:
    """Write report.html, study.json, differences.csv, and the part of a Markdown page if asked.

    Only what is done is reported, and the report says how much is not.
    """
    results = gather(progress)
    found = contrasts(results)
    drawn = figures(results, found)
    report = _report(config, results, found, drawn)
    written = report.write(progress.layout.root, "study.json")
    if config.page:
        with explained(f"--page {config.page}"):
            written += _write_page(config, progress.design, report, drawn)
    return written


def _report(
    config: StudyConfig, results: Results, found: Sequence[Contrast], drawn: Mapping[str, Any]
) -> Report:
    design = results.progress.design
    shown = [(CAPTIONS[name], "", svg(figure)) for name, figure in drawn.items()]
    by_task = [(task.replace("_", " ").capitalize(), tables.of_task(task, results)) for task in design.tasks]
    again = [tables.times_table(results), tables.cells_table(results, config.preset)]
    return Report(
        title=f"Study {design.name}: {', '.join(design.rounds.ways if design.rounds else design.modes)}",
        headline=" ".join(answer(found, design)),
        limits=cautions(results),
        sections=[
            ("Figures", [panels(shown, "wide")]),
            ("Contrasts", tables.of_contrasts(found, results)),
            *by_task,
            ("Again", [table for table in again if table.rows]),
        ],
        how=f"{_HOW_ROUNDS if design.rounds else _HOW} {plan(design)}",
        content=_content(config, results, found),
        values=[each.value for each in results.conditions.values()],
        contrasts=found,
    )


def _content(config: StudyConfig, results: Results, found: Sequence[Contrast]) -> dict[str, Any]:
    progress = results.progress
    done = {job.name: note for job, note in progress.notes.items()}
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
    config: StudyConfig, design: StudyDesign, report: Report, drawn: Mapping[str, Any]
) -> list[Path]:
    """Put tables and figures between the study's marks; figures and JSON go beside the page."""
    page = Path(config.page).expanduser()
    stem = f"{page.stem}_{design.name}"
    pictures = {name: page.parent / f"{stem}_{name}.png" for name in drawn}
    for name, figure in drawn.items():
        write_whole(pictures[name], png(figure))
    data = page.parent / f"{stem}.json"
    write_whole(data, report.json.encode())
    _, (_, compared), *by_task, (_, again) = report.sections
    parts = ["\n".join(f"- {text}" for text in (*report.content["answer"], *report.cautions))]
    parts += [f"![{CAPTIONS[name]}]({picture.name})" for name, picture in pictures.items()]
    parts += [markdown_table(table) for table in compared if isinstance(table, Table)]
    for title, found in by_task:
        shown = [markdown_table(table) for table in found if isinstance(table, Table)]
        parts += [f"### {title}", *shown] if shown else []
    parts += ["### How to read this", report.how]
    parts += [markdown_table(table) for table in again[:-1] if isinstance(table, Table)]
    parts.append(
        f"`handrail-study --preset {config.preset}` wrote this, design `{design.digest}`."
        f" `{report.content['again']}` runs one cell anew, with the same rows and the same rollouts; digests"
        " are in the JSON."
    )
    title = "Taking over from a policy" if design.rounds else "Teleoperation modes"
    write_part(page, title, f"study {design.name}", "\n\n".join(filter(None, parts)))
    return [page, data, *pictures.values()]


def answer(found: Sequence[Contrast], design: StudyDesign) -> list[str]:
    """Return the headline: a sentence for each declared contrast, then of equivalence."""
    asked, tested = declared(design), {each.label: each for each in found if each.family == DECLARED}
    if not asked:
        return ["No contrast was declared before the run: all results explore, and nothing is tested."]
    if not tested:
        return ["No draw has all that is declared on all tasks yet: nothing can be said."]
    if design.rounds:
        return [sentence(v, k, " against ".join(map(percent, v.sides or ()))) for k, v in tested.items()]
    return [sentence(each, name) for name, each in tested.items()] + [
        _equivalent(tested[each.label], each) for each in asked if each.margin and each.label in tested
    ]


def _equivalent(found: Contrast, asked: Declared) -> str:
    """Return whether both sides are equivalent, which is not said before all draws are done."""
    p = equivalence_p(found, asked.margin)
    verdict = "not tested before all draws are done"
    if p is not None and found.p_adjusted is not None:
        verdict = f"{'' if p < LEVEL else 'not '}shown, {p_value(p)}"
    return f"Equivalence of {asked.label} within {100 * asked.margin:g} points: {verdict}."


def cautions(results: Results) -> dict[str, object]:
    """Return what stands in the way of reading the results as they are meant, and whether it does."""
    progress, design = results.progress, results.progress.design
    seen = [each["digest"] for each in designs(progress.layout)]
    notes = progress.notes
    again = [job.cell.name for job, note in notes.items() if "digest_before" in note["result"]]
    missing, jobs = len(progress.missing), len(progress.jobs)
    said = {str(each) for note in notes.values() if (each := note.get("took", {}).get("versions"))}
    return {
        _LIMITS: True,
        "One draw does not say how much another recording would differ.": design.draws < 2,
        f"{missing} of {jobs} jobs are not done yet: study.json names them.": missing,
        "The design was changed after the study began. Digests, in order:"
        f" {', '.join(seen)}; this report is of {design.digest}.": {*seen} - {design.digest},
        "Jobs ran under other versions than others; the notes of the jobs say which.": len(said) > 1,
        f"Recorded again, and the rows were others than before: {', '.join(again)}.": again,
    }
