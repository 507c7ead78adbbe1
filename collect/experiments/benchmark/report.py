"""The benchmark's report: one HTML file that carries its figures and its video."""

import base64
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from handrail.collect.experiments.benchmark.format import (
    COMPARED,
    Table,
    main_table,
    paired_table,
    profile_table,
    safety_table,
    settles,
    settling_table,
)
from handrail.collect.experiments.benchmark.metrics import COST_METRICS, METRICS, SETTLED_METRICS
from handrail.datasets.storage.atomic import write_whole

_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #222; }
body { margin: 2rem auto; max-width: 1180px; padding: 0 1rem; }
table { border-collapse: collapse; font-size: 13px; margin: .6rem 0 1.6rem; }
table { display: block; overflow-x: auto; }
th, td { border-bottom: 1px solid #ddd; padding: .3rem .6rem; text-align: left; white-space: nowrap; }
tr:first-child th { border-bottom: 2px solid #888; } tr.published { color: #777; font-style: italic; }
img, video { max-width: 100%; } .finding { font-size: 17px; } code { background: #f3f3f3; padding: 0 .2em; }
"""


def write_report(
    results: Mapping[str, Any], pictures: Mapping[str, bytes], video: Path | None, path: Path
) -> None:
    """Write the report.

    Args:
        results: as summarised.
        pictures: PNG by name.
        video: a file to embed.
        path: of the HTML file.
    """
    parts = ["<h1>Goal reaching</h1>", *(f'<p class="finding">{line}</p>' for line in _findings(results))]
    for profile in results["profiles"]:
        parts += [f"<h2>Profile {escape(profile)}</h2>", "<p>Mean ± SD (min, max) over the episodes.</p>"]
        parts.append(_table(main_table(results, (*METRICS, *COST_METRICS, *SETTLED_METRICS), profile)))
        if settles(results):
            parts.append(_table(settling_table(results, profile)))
        parts += ["<h3>Safety</h3>", _table(safety_table(results, profile))]
        if results["paired"][profile]:
            parts += [f"<h3>Paired differences</h3><p>{_PAIRED}</p>"]
            parts.append(_table(paired_table(results, COMPARED, profile)))
    if len(results["profiles"]) > 1:
        parts += ["<h2>All profiles</h2>", _table(profile_table(results))]
    parts += ["<h2>Figures</h2>", *(_picture(name, data) for name, data in pictures.items())]
    if video is not None:
        parts.append(f"<h2>Example</h2>{_video(video)}")
    parts.append(_conditions(results))
    head = f'<meta charset="utf-8"><title>Goal reaching</title><style>{_STYLE}</style>'
    page = f'<!doctype html><html lang="en">{head}' + "\n".join(parts) + "</html>\n"
    write_whole(path, page.encode())


_PAIRED = (
    "The first controller minus each other one on the same goals: mean, 95 % bootstrap interval, p of "
    "Wilcoxon's signed-rank test; for success, goals that only the first (+) or only the other (−) reached "
    "and p of McNemar's exact test."
)


def _findings(results: Mapping[str, Any]) -> list[str]:
    """Return what can be seen at once, one line a controller."""
    lines = []
    for name, summary in results["controllers"].items():
        low, high = summary["success"]["interval"]
        share = summary["success"]["mean"]
        lines.append(
            f"<b>{escape(results['titles'][name])}</b>: {share:.0%} of {summary['episodes']} goals "
            f"(95 % interval {low:.0%} to {high:.0%}), "
            f"in contact in {summary['episodes_with_contact']} episodes"
        )
    return lines


def _table(table: Table) -> str:
    headings, rows = table
    head = "".join(f"<th>{escape(heading)}</th>" for heading in headings)
    lines = [_row(row) for row in rows]
    return f"<table><tr>{head}</tr>{''.join(lines)}</table>"


def _row(cells: Sequence[str]) -> str:
    kind = ' class="published"' if cells[0].startswith("paper") else ""
    return f"<tr{kind}>" + "".join(f"<td>{escape(cell)}</td>" for cell in cells) + "</tr>"


def _picture(name: str, data: bytes) -> str:
    return f'<p><img alt="{escape(name)}" src="data:image/png;base64,{base64.b64encode(data).decode()}"></p>'


def _video(path: Path) -> str:
    data = base64.b64encode(path.read_bytes()).decode()
    return f'<video controls muted loop src="data:video/mp4;base64,{data}"></video>'


def _conditions(results: Mapping[str, Any]) -> str:
    groups = ("config", "mpc_settings", "mpc_paper_settings", "physics", "machine", "versions", "skipped")
    lines = [
        f"<p><b>{group}</b>: "
        + ", ".join(f"<code>{escape(str(k))} {escape(str(v))}</code>" for k, v in results[group].items())
        for group in groups
        if results[group]
    ]
    return "<h2>Conditions</h2>" + "".join(lines)
