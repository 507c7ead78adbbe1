"""What a study writes: a page for people, JSON for programs, and its part of a Markdown page."""

import importlib.metadata
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from handrail.collect.session.build import software_versions
from handrail.datasets.comparison.finding import Finding
from handrail.datasets.comparison.report.report import json_text
from handrail.datasets.presentation import markup
from handrail.datasets.presentation.drawing import png, svg
from handrail.datasets.presentation.markdown import markdown_table, write_part
from handrail.datasets.storage.atomic import explained, write_whole
from handrail.policies.study.config import StudyConfig
from handrail.policies.study.design.progress import StudyProgress
from handrail.policies.study.report.figures import figures
from handrail.policies.study.report.gather import gather
from handrail.policies.study.report.how import how
from handrail.policies.study.report.results import TaskResults
from handrail.policies.study.report.tables import tables

_CAPTIONS = {
    "answer": "Success of the policies; thick: 95 % for these policies, thin: with training, ticks: training"
    " seeds. Round: joint velocities, unprotected; diamonds: intent through the MPC, policy and controller.",
    "robustness": "Success disturbed and undisturbed, of the same policies in the same scenes.",
    "sweep": "How human the operator is, and what that does to policies and to the operator's time.",
}
_FORMAT = "handrail.study/1"


def write_study(config: StudyConfig, progress: StudyProgress) -> list[Path]:
    """Write report.html and study.json, and the part of a Markdown page if asked; return the files.

    Args:
        config: says whether there is a page.
        progress: of the study: only what is done is reported, and it says how much is not.

    Raises:
        HandrailError: a file cannot be written.
    """
    design, root = progress.design, progress.layout.root
    results = gather(progress, np.random.default_rng(design.seed))
    drawn = figures(design, results)
    files = {
        root / "report.html": _html(progress, results, drawn),
        root / "study.json": _json(progress, results),
    }
    with explained("study: expected a folder that can be written"):
        for path, text in files.items():
            write_whole(path, text.encode())
        written = list(files)
        if config.page:
            written += _write_page(Path(config.page).expanduser(), progress, results, drawn)
    return written


def _html(progress: StudyProgress, results: Sequence[TaskResults], drawn: Mapping[str, Any]) -> str:
    design, layout = progress.design, progress.layout
    title = f"Study {design.name}: {', '.join(design.modes)}"
    answers = [f"{_title(each)}. {each.answer}" for each in results if each.answer]
    parts = [markup.paragraph(answer, "headline") for answer in answers]
    parts += [markup.paragraph(f"{progress.words}.")] if progress.words else []
    pictures = [(_CAPTIONS[name], "", svg(figure)) for name, figure in drawn.items()]
    parts += [markup.section("Figures", markup.panels(pictures, "wide"))] if pictures else []
    for each in results:
        words = [(_look(found), found.text) for found in each.findings]
        link = ""
        if (layout.comparison(each.task) / "report.html").is_file():
            address = f"comparisons/{each.task}/report.html"
            link = markup.link("The demonstrations compared: quality, trajectories", address)
        parts.append(markup.section(_title(each), markup.items(words), link, *tables(each)))
    parts.append(markup.section("How to read this", markup.paragraph(how(design, results))))
    return markup.page(title, *parts)


def _look(found: Finding) -> str:
    return "caution" if found.kind == "caution" else "detected" if found.detected else "quiet"


def _bullet(found: Finding) -> str:
    return f"- {'Caution: ' if found.kind == 'caution' else ''}{found.text}"


def _title(results: TaskResults) -> str:
    return results.task.replace("_", " ").capitalize()


def _json(progress: StudyProgress, results: Sequence[TaskResults]) -> str:
    versions = software_versions() | {"torch": importlib.metadata.version("torch")}
    content = {
        "format": _FORMAT,
        "design": asdict(progress.design),
        "missing": progress.missing,
        "versions": versions,
        "tasks": {each.task: asdict(each) for each in results},
    }
    return json_text(content)


def _write_page(
    page: Path, progress: StudyProgress, results: Sequence[TaskResults], drawn: Mapping[str, Any]
) -> list[Path]:
    """Put tables and figures between the study's marks; figures and JSON go beside the page."""
    design = progress.design
    stem = f"{page.stem}_{design.name}"
    parts = [f"`handrail-study --preset {design.name}` wrote this. {how(design, results)}"]
    parts += [f"{progress.words}."] if progress.words else []
    written = [page]
    for name, figure in drawn.items():
        picture = page.parent / f"{stem}_{name}.png"
        write_whole(picture, png(figure))
        parts.append(f"![{_CAPTIONS[name]}]({picture.name})")
        written.append(picture)
    for each in results:
        parts += [f"### {_title(each)}", "\n".join(map(_bullet, each.findings))]
        parts += map(markdown_table, tables(each))
    data = page.parent / f"{stem}.json"
    write_whole(data, _json(progress, results).encode())
    body = "\n\n".join(filter(None, parts))
    write_part(page, "Teleoperation modes", f"study {design.name}", body)
    return [*written, data]
