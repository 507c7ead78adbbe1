"""What every comparison shows and writes: one table of contrasts, one JSON, one CSV."""

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from handrail.datasets.presentation.table import Cell, Table
from handrail.datasets.presentation.wording import (
    DASH,
    WITH_TRAINING,
    number,
    p_alone,
    percent,
    percent_span,
    points,
    points_span,
    signed,
    span,
)
from handrail.datasets.statistics.contrast import RATIO, SHARE, Contrast, Measure
from handrail.datasets.statistics.resampling import Interval
from handrail.datasets.storage.atomic import explained, write_whole
from handrail.datasets.storage.csv_file import csv_text


def shown(measure: Measure, value: float | None) -> str:
    """Return a value of a measure."""
    return percent(value) if measure.unit == SHARE else number(value)


def shown_interval(measure: Measure, interval: Interval | None) -> str:
    """Return an interval of a measure."""
    return percent_span(interval) if measure.unit == SHARE else span(interval)


def measure_cell(measure: Measure, ranked: bool = True, mark: str = "") -> Cell:
    """Return what a measure is called, its unit, and which direction is better if that counts."""
    unit = "" if measure.unit in (SHARE, RATIO) else measure.unit
    good = f"{measure.good} is better" if measure.good and ranked else ""
    return Cell(measure.title + mark, "", measure.meaning, " · ".join(filter(None, (unit, good))))


def difference_cell(each: Contrast) -> Cell:
    """Return the estimate, bold where a difference was detected."""
    if each.estimate is None:
        return Cell("missing" if not each.reason else DASH, "quiet", each.reason)
    texts = {SHARE: f"{points(each.estimate)} points", RATIO: f"× {number(each.estimate)}"}
    text = texts.get(each.measure.unit, signed(each.estimate))
    return Cell(text, "detected" if each.detected else "")


def _interval(measure: Measure, interval: Interval | None) -> str:
    return points_span(interval) if measure.unit == SHARE else span(interval)


def _detectable(each: Contrast) -> str:
    seen = each.seen if each.estimate is not None else None
    return DASH if seen is None else f"{100 * seen:.0f} points"


Column = Callable[[Contrast], Cell | str]
COLUMNS: Mapping[str, Column] = {
    "measure": lambda each: measure_cell(each.measure),
    "group": lambda each: f"{each.label} against {each.baseline}" if each.baseline else each.label,
    "of": lambda each: each.scope,
    "difference": difference_cell,
    "95 %": lambda each: _interval(each.measure, each.interval),
    WITH_TRAINING: lambda each: _interval(each.measure, each.nested),
    "p": lambda each: p_alone(None if each.p_adjusted is None else each.p),
    "p, Holm": lambda each: p_alone(each.p_adjusted),
    "family": lambda each: f"{each.tests} {each.family}",
    "n": lambda each: ", ".join(map(str, each.counts)),
    "detectable": _detectable,
}


def contrast_table(
    contrasts: Sequence[Contrast],
    columns: Sequence[str],
    title: str = "",
    caption: str = "",
    more: Mapping[str, Column] | None = None,
) -> Table:
    """Return a row a contrast.

    Args:
        contrasts: Which.
        columns: Names of `COLUMNS`.
        title: Above the table.
        caption: Below it.
        more: Further columns, by heading.
    """
    chosen = {name: COLUMNS[name] for name in columns} | dict(more or {})
    rows = [[column(each) for column in chosen.values()] for each in contrasts]
    return Table([name if name not in ("measure", "group") else "" for name in chosen], rows, title, caption)


def write_report(
    folder: Path,
    html: str,
    content: Mapping[str, Any],
    contrasts: Iterable[Contrast],
    units: Mapping[str, Iterable[Mapping[str, Any]]],
    source: Mapping[str, Any] | None = None,
    name: str = "report.json",
) -> list[Path]:
    """Write the report into a folder and return the files.

    Args:
        folder: Made if it is not there.
        html: The page.
        content: Of the JSON, beside its contrasts.
        contrasts: What was compared, for the JSON and for differences.csv.
        units: Rows of further CSV files by name, a row for each unit.
        source: Where the numbers come from, for each row of differences.csv.
        name: Of the JSON.
    """
    found = list(contrasts)
    tables = {**units, "differences.csv": [dict(source or {}) | each.row for each in found]}
    texts = {"report.html": html, name: report_json(content, found)}
    texts |= {file: csv_text(plain(list(rows))) for file, rows in tables.items() if rows}
    with explained(f"--output {str(folder)!r}: expected a folder that can be written"):
        for file, text in texts.items():
            write_whole(folder / file, text.encode())
    return [folder / file for file in texts]


def report_json(content: Mapping[str, Any], contrasts: Iterable[Contrast]) -> str:
    """Return content and contrasts as JSON; what is no finite number is null."""
    whole = dict(content) | {"contrasts": [each.content for each in contrasts]}
    return json.dumps(plain(whole), indent=1, allow_nan=False) + "\n"


def plain(value: Any) -> Any:
    """Return a value as JSON has it; what is no finite number is None."""
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    if hasattr(value, "item"):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
