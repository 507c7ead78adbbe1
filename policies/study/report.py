"""What a study writes: a page for people, JSON for programs, and its part of a Markdown page."""

import importlib.metadata
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from handrail.collect.build import software_versions
from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison import markup
from handrail.datasets.comparison.drawing import svg
from handrail.datasets.comparison.findings import Finding
from handrail.datasets.comparison.report import plain
from handrail.policies.study.config import StudyConfig
from handrail.policies.study.design import StudyDesign
from handrail.policies.study.figures import figures
from handrail.policies.study.how import how
from handrail.policies.study.jobs import Layout
from handrail.policies.study.results import TaskResults, gather
from handrail.policies.study.tables import Table, tables

_CAPTIONS = {
    "answer": "Success of the policies; thick: 95 % for these policies, thin: with training, ticks: training"
    " seeds. Round: joint velocities, unprotected; diamonds: intent through the MPC, policy and controller.",
    "robustness": "Success disturbed and undisturbed, of the same policies in the same scenes.",
    "sweep": "How human the operator is, and what that does to policies and to his time.",
}
_FORMAT = "handrail.study/1"
_DPI = 110


def write_study(config: StudyConfig, design: StudyDesign, layout: Layout) -> list[Path]:
    """Write report.html and study.json, and the part of a Markdown page if asked; return the files.

    Raises:
        HandrailError: a file cannot be written.
    """
    results = gather(design, layout, np.random.default_rng(design.seed))
    drawn = figures(design, results)
    files = {
        layout.root / "report.html": _html(design, results, drawn, layout),
        layout.root / "study.json": _json(design, results),
    }
    try:
        for path, text in files.items():
            path.write_text(text, encoding="utf-8")
        written = list(files)
        if config.page:
            written += _write_page(Path(config.page).expanduser(), design, results, drawn)
    except OSError as error:
        raise HandrailError(f"study: expected a folder that can be written, got {error}") from error
    return written


def _html(
    design: StudyDesign, results: Sequence[TaskResults], drawn: Mapping[str, Any], layout: Layout
) -> str:
    title = f"Study {design.name}: {', '.join(design.modes)}"
    parts = [f"<header><h1>{title}</h1></header>"]
    answers = [f"{_title(each)}. {each.answer}" for each in results if each.answer]
    parts += [markup.paragraph(answer, "headline") for answer in answers]
    for name, figure in drawn.items():
        parts.append(markup.section(_CAPTIONS[name], markup.picture(svg(figure), name)))
    for each in results:
        shown = [
            f"<h3>{table.title}</h3>{markup.table(table.headings, table.rows)}" for table in tables(each)
        ]
        words = [(_look(found), found.text) for found in each.findings]
        link = ""
        if (layout.comparison(each.task) / "report.html").is_file():
            address = f"comparisons/{each.task}/report.html"
            link = f'<p><a href="{address}">The demonstrations compared: quality, trajectories</a></p>'
        parts.append(markup.section(_title(each), markup.items(words), link, *shown))
    parts.append(markup.section("How to read this", markup.paragraph(how(design, results))))
    return markup.page(title, "".join(parts))


def _look(found: Finding) -> str:
    return "caution" if found.kind == "caution" else "detected" if found.detected else "quiet"


def _bullet(found: Finding) -> str:
    return f"- {'Caution: ' if found.kind == 'caution' else ''}{found.text}"


def _title(results: TaskResults) -> str:
    return results.task.replace("_", " ").capitalize()


def _json(design: StudyDesign, results: Sequence[TaskResults]) -> str:
    versions = software_versions() | {"torch": importlib.metadata.version("torch")}
    content = {
        "format": _FORMAT,
        "design": asdict(design),
        "versions": versions,
        "tasks": {each.task: asdict(each) for each in results},
    }
    return json.dumps(plain(content), indent=1, ensure_ascii=False) + "\n"


def _write_page(
    page: Path, design: StudyDesign, results: Sequence[TaskResults], drawn: Mapping[str, Any]
) -> list[Path]:
    """Put tables and figures between the study's marks; figures and JSON go beside the page."""
    stem = f"{page.stem}_{design.name}"
    parts = [f"`handrail-study --preset {design.name}` wrote this. {how(design, results)}"]
    written = [page]
    for name, figure in drawn.items():
        picture = page.parent / f"{stem}_{name}.png"
        stream = io.BytesIO()
        figure.savefig(stream, format="png", dpi=_DPI, metadata={"Software": None})
        picture.write_bytes(stream.getvalue())
        parts.append(f"![{_CAPTIONS[name]}]({picture.name})")
        written.append(picture)
    for each in results:
        parts += [f"### {_title(each)}", "\n".join(map(_bullet, each.findings))]
        parts += [f"**{table.title}**\n\n{_markdown(table)}" for table in tables(each)]
    data = page.parent / f"{stem}.json"
    data.write_text(_json(design, results), encoding="utf-8")
    text = page.read_text(encoding="utf-8") if page.exists() else "# Teleoperation modes\n"
    page.write_text(_between_marks(text, design.name, "\n\n".join(filter(None, parts))), encoding="utf-8")
    return [*written, data]


def _between_marks(text: str, name: str, body: str) -> str:
    begin, end = f"<!-- study {name} -->", f"<!-- end of study {name} -->"
    before, found, rest = text.partition(begin)
    if not found:
        return f"{text.rstrip()}\n\n{begin}\n\n{body}\n\n{end}\n"
    return f"{before}{begin}\n\n{body}\n\n{end}" + rest.partition(end)[2]


def _markdown(table: Table) -> str:
    lines = [table.headings, ["---"] * len(table.headings), *table.rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)
