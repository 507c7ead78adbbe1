"""What a study writes: a page for people, JSON for programs, and its part of a Markdown page."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from handrail.controllers.versions import SIMULATION, versions
from handrail.datasets.comparison.report.report import json_text
from handrail.datasets.presentation import markup
from handrail.datasets.presentation.drawing import png, svg
from handrail.datasets.presentation.markdown import markdown_table, write_part
from handrail.datasets.presentation.table import Table
from handrail.datasets.storage.atomic import explained, write_whole
from handrail.policies.study.config import StudyConfig
from handrail.policies.study.design.designs import designs
from handrail.policies.study.design.progress import StudyProgress
from handrail.policies.study.report import tables
from handrail.policies.study.report.contrasts import DECLARED, EXPLORATORY, SYSTEM, Contrast, contrasts
from handrail.policies.study.report.figures import figures
from handrail.policies.study.report.results import Condition, Results, gather
from handrail.policies.study.report.words import answer, cautions, how

_CAPTIONS = {
    "contrasts": "What makes a difference: declared, over all tasks (dark), and in each task (grey).",
    "answer": "Success of the policies; lines: 95 %, ticks: draws. Round: joint velocities, unprotected;"
    " diamonds: intent through the MPC, policy and controller;"
    " squares: the same number of demonstrations.",
    "training": "Loss on held-out episodes while the policies learnt; a dot is where the training ended.",
    "robustness": "Success disturbed and undisturbed.",
}
_FORMAT = "handrail.study/3"
_OF_TASK = (
    tables.conditions_table,
    tables.failures_table,
    tables.collection_table,
    tables.quality_table,
    tables.treatments_table,
)


@dataclass(frozen=True)
class _Findings:
    """What is reported.

    Attributes:
        config: how the study was called.
        results: of its jobs.
        contrasts: of its policies.
        figures: by name.
    """

    config: StudyConfig
    results: Results
    contrasts: Sequence[Contrast]
    figures: Mapping[str, Any]

    @property
    def answer(self) -> list[str]:
        return answer(self.contrasts, self.results.progress.design)

    @property
    def of_all(self) -> list[Table]:
        kinds = (DECLARED, SYSTEM, EXPLORATORY)
        made = [tables.contrasts_table(self.contrasts, kind, self.results) for kind in kinds]
        return [table for table in made if table.rows]

    def of_task(self, task: str) -> list[Table]:
        return [table for make in _OF_TASK if (table := make(task, self.results)).rows]


def write_study(config: StudyConfig, progress: StudyProgress) -> list[Path]:
    """Write report.html and study.json, and the part of a Markdown page if asked; return the files.

    Args:
        config: says whether there is a page.
        progress: of the study: only what is done is reported, and it says how much is not.
    """
    root, results = progress.layout.root, gather(progress)
    found = contrasts(results)
    findings = _Findings(config, results, found, figures(results, found))
    files = {root / "report.html": _html(findings), root / "study.json": _json(findings)}
    with explained("study: expected a folder that can be written"):
        for path, text in files.items():
            write_whole(path, text.encode())
        written = list(files)
        if config.page:
            written += _write_page(findings)
    return written


def _html(findings: _Findings) -> str:
    results, design = findings.results, findings.results.progress.design
    first, *others = findings.answer
    parts = [markup.paragraph(first, "headline")]
    told = [("", text) for text in others] + [("caution", text) for text in cautions(results)]
    parts.append(markup.items(told))
    pictures = [(_CAPTIONS[name], "", svg(figure)) for name, figure in findings.figures.items()]
    parts += [markup.section("Figures", markup.panels(pictures, "wide"))] if pictures else []
    if findings.of_all:
        parts.append(markup.section("Contrasts", *findings.of_all))
    parts += [markup.section(_title(task), *findings.of_task(task)) for task in design.tasks]
    parts.append(markup.section("How to read this", markup.paragraph(how(design))))
    again = tables.times_table(results), tables.cells_table(results, findings.config.preset)
    parts.append(markup.section("Again", *(table for table in again if table.rows)))
    return markup.page(f"Study {design.name}: {', '.join(design.modes)}", *parts)


def _title(task: str) -> str:
    return task.replace("_", " ").capitalize()


def _json(findings: _Findings) -> str:
    progress = findings.results.progress
    done = {job.name: note for job in progress.jobs if (note := progress.note(job))}
    took = [note.get("took", {}) for note in done.values()]
    content = {
        "format": _FORMAT,
        "design": asdict(progress.design),
        "designs": designs(progress.layout),
        "missing": progress.missing,
        "versions": versions(*SIMULATION, "torch"),
        "answer": findings.answer,
        "contrasts": [asdict(each) for each in findings.contrasts],
        "conditions": [_numbers(each) for each in findings.results.conditions.values()],
        "jobs": {name: {"result": note["result"], "took": note.get("took")} for name, note in done.items()},
        "seconds": sum(each.get("seconds", 0.0) for each in took),
        "processor_seconds": sum(each.get("processor_seconds", 0.0) for each in took),
        "again": tables.cell_command(findings.config.preset, "TASK/MODE/DRAW"),
    }
    return json_text(content)


def _numbers(condition: Condition) -> dict[str, Any]:
    return {
        "task": condition.task,
        "label": condition.label,
        "treatment": condition.treatment,
        "success": asdict(condition.success),
        "interval": condition.interval,
        "draws": {str(draw): share for draw, share in condition.shares.items()},
        "successes": int(condition.rolled().sum()),
        "rollouts": len(condition.rolled()),
        "touched": float(condition.rolled("contact").mean()),
        "length": condition.mean("length"),
        "failures": dict(condition.failures),
    }


def _write_page(findings: _Findings) -> list[Path]:
    """Put tables and figures between the study's marks; figures and JSON go beside the page."""
    results, preset = findings.results, findings.config.preset
    page, design = Path(findings.config.page).expanduser(), results.progress.design
    stem = f"{page.stem}_{design.name}"
    parts = ["\n".join(f"- {text}" for text in (*findings.answer, *cautions(results)))]
    written = [page]
    for name, figure in findings.figures.items():
        picture = page.parent / f"{stem}_{name}.png"
        write_whole(picture, png(figure))
        parts.append(f"![{_CAPTIONS[name]}]({picture.name})")
        written.append(picture)
    parts += map(markdown_table, findings.of_all)
    for task in design.tasks:
        if of_task := findings.of_task(task):
            parts += [f"### {_title(task)}", *map(markdown_table, of_task)]
    parts += ["### How to read this", how(design)]
    times = tables.times_table(results)
    parts += [markdown_table(times)] if times.rows else []
    again = tables.cell_command(preset, "TASK/MODE/DRAW")
    parts.append(
        f"`handrail-study --preset {preset}` wrote this, design `{design.digest}`. `{again}` runs one"
        " cell anew, with the same rows and the same rollouts; digests are in the JSON."
    )
    data = page.parent / f"{stem}.json"
    write_whole(data, _json(findings).encode())
    write_part(page, "Teleoperation modes", f"study {design.name}", "\n\n".join(filter(None, parts)))
    return [*written, data]
