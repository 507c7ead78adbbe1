"""The output of every comparison: a table of contrasts, and a report as page, JSON and CSV."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from handrail.datasets.presentation import wording
from handrail.datasets.presentation.markup import folded, items, page, paragraph, section
from handrail.datasets.presentation.table import Cell, Table
from handrail.datasets.statistics.contrast import RATIO, SHARE, Contrast, Measure, Value
from handrail.datasets.statistics.resampling import Interval
from handrail.datasets.storage.atomic import explained, remove, write_whole
from handrail.datasets.storage.csv_file import csv_text

Rows = Sequence[Mapping[str, Any]]
_TABLES = {"differences.csv", "episodes.csv", "trials.csv"}


def shown(value: Value, *more: str) -> Cell:
    """Return a value of a measure, its intervals and more below."""
    if value.estimate is None:
        return Cell("missing", "quiet", value.reason, "; ".join(more))
    share = value.measure.unit == SHARE
    text, spanned = (wording.percent, wording.percent_span) if share else (wording.number, wording.span)
    training = f"{spanned(value.nested)} with training" if value.nested else ""
    below = spanned(value.interval) if value.interval else "", training, *more
    return Cell(text(value.estimate), below="; ".join(filter(None, below)))


def values_table(
    values: Sequence[Value],
    title: str = "",
    caption: str = "",
    rows: Mapping[str, Mapping[str, str]] | None = None,
    note: Callable[[Value], str] = lambda value: "",
) -> Table:
    """Return a row a measure, a column a condition; then rows of texts by label.

    Args:
        values: The numbers shown.
        title: Above the table.
        caption: Below it.
        rows: More, by heading.
        note: The text below a value, beside its interval.
    """
    labels = list(dict.fromkeys(each.label for each in values))
    cells = {(each.measure.name, each.label): shown(each, note(each)) for each in values}
    measures = {each.measure.name: each.measure for each in values}
    found: list[Sequence[Cell | str]] = [
        [measure_cell(each), *(cells.get((name, label), wording.DASH) for label in labels)]
        for name, each in measures.items()
    ]
    found += [[name, *(texts[label] for label in labels)] for name, texts in (rows or {}).items()]
    return Table(("", *labels), found, title, caption)


def measure_cell(measure: Measure, ranked: bool = True, mark: str = "") -> Cell:
    """Return the title of a measure, its unit, and which direction is better if that counts."""
    unit = "" if measure.unit in (SHARE, RATIO) else measure.unit
    good = f"{measure.good} is better" if measure.good and ranked else ""
    return Cell(measure.title + mark, "", measure.meaning, " · ".join(filter(None, (unit, good))))


def difference_cell(each: Contrast, below: str = "") -> Cell:
    """Return the estimate, bold where a difference was detected."""
    if each.estimate is None:
        return Cell("missing" if not each.reason else wording.DASH, "quiet", each.reason)
    return Cell(_difference(each, each.estimate), "detected" if each.detected else "", below=below)


def _difference(each: Contrast, estimate: float) -> str:
    texts = {SHARE: f"{wording.points(estimate)} points", RATIO: f"× {wording.number(estimate)}"}
    return texts.get(each.measure.unit, wording.signed(estimate))


def sentence(each: Contrast, name: str, *sides: str) -> str:
    """Return what a contrast says, never more than its intervals; `sides` are the values of both."""
    if each.estimate is None:
        return f"{name}: {each.reason}."
    told, interval = ", ".join(sides), each.widest
    told = f"{told}; {_difference(each, each.estimate)}" if told else _difference(each, each.estimate)
    if interval is None:
        return f"{name}: {told}; one draw tests nothing."
    seen = f"{'a' if each.detected else 'no'} difference detected"
    verdict = each.reason or "not tested before all draws are done" if each.p_adjusted is None else seen
    return f"{name}: {told} (95 % {_interval(each.measure, interval)}), {verdict}."


def _interval(measure: Measure, interval: Interval | None) -> str:
    return wording.points_span(interval) if measure.unit == SHARE else wording.span(interval)


def _detectable(each: Contrast) -> str:
    seen = each.seen if each.estimate is not None else None
    return wording.DASH if seen is None else f"{100 * seen:.0f} points"


Column = Callable[[Any], Cell | str]
COLUMNS: Mapping[str, Column] = {
    "measure": lambda each: measure_cell(each.measure),
    "group": lambda each: f"{each.label} against {each.baseline}" if each.baseline else each.label,
    "of": lambda each: each.scope,
    "difference": difference_cell,
    "95 %": lambda each: _interval(each.measure, each.interval),
    wording.WITH_TRAINING: lambda each: _interval(each.measure, each.nested),
    "p": lambda each: wording.p_alone(None if each.p_adjusted is None else each.p),
    "p, Holm": lambda each: wording.p_alone(each.p_adjusted),
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
    """Return a row a contrast: some of `COLUMNS`, then more, by heading."""
    chosen = {name: COLUMNS[name] for name in columns} | dict(more or {})
    rows = [[column(each) for column in chosen.values()] for each in contrasts]
    return Table([name if name not in ("measure", "group") else "" for name in chosen], rows, title, caption)


@dataclass(frozen=True, kw_only=True)
class Report:
    """The result of a comparison, for a terminal, as a page that needs nothing else, as JSON and as CSV."""

    title: str
    headline: str = ""
    limits: Mapping[str, object] = field(default_factory=dict)  # texts, and whether each holds
    tables: Sequence[Table] = ()  # of the terminal
    what: str = ""  # is compared
    first: Sequence[str] = ()  # below the headline
    sections: Sequence[tuple[str, Sequence[str | Table]]]
    how: str  # to read it
    content: Mapping[str, Any]  # of the JSON, beside values and contrasts
    values: Sequence[Value]
    contrasts: Sequence[Contrast]
    units: Mapping[str, Rows] = field(default_factory=dict)  # of CSV files, a row for each unit
    source: Mapping[str, Any] = field(default_factory=dict)  # of the numbers, in the JSON and each row of CSV

    @property
    def cautions(self) -> list[str]:
        """The limits that hold."""
        return [text for text, holds in self.limits.items() if holds]

    @property
    def html(self) -> str:
        """The page: the answer first, then how it came about."""
        cautions = items(("caution", text) for text in self.cautions)
        measures = {each.measure.name: each.measure for each in self.values if each.measure.meaning}
        meanings = items(("quiet", f"{each.title}: {each.meaning}.") for each in measures.values())
        parts = [paragraph(self.headline, "headline") if self.headline else "", *self.first]
        parts += [section("Read this first", cautions) if self.cautions else ""]
        parts += [section(title, *shown) for title, shown in self.sections if any(shown)]
        told = [paragraph(self.how), folded("The meaning of every measure", meanings) if measures else ""]
        return page(self.title, *parts, section("How to read this", *told), what=self.what)

    @property
    def json(self) -> str:
        """Content, values and contrasts."""
        numbers = {"values": self.values, "contrasts": self.contrasts}
        whole = {**self.source, **self.content, "headline": self.headline, "cautions": self.cautions}
        whole |= {name: [each.content for each in found] for name, found in numbers.items()}
        return json.dumps(_plain(whole), indent=1, allow_nan=False) + "\n"

    def write(self, folder: Path, name: str = "report.json") -> list[Path]:
        """Write page, JSON and CSV files into a folder, made if it is not there; return the files."""
        tables = {**self.units, "differences.csv": [each.row for each in self.contrasts]}
        texts = {"report.html": self.html, name: self.json}
        tables = {file: [{**self.source, **row} for row in rows] for file, rows in tables.items() if rows}
        texts |= {file: csv_text(_plain(rows)) for file, rows in tables.items()}
        with explained(f"--output {str(folder)!r}: expected a folder that can be written"):
            for file, text in texts.items():
                write_whole(folder / file, text.encode())
            for file in _TABLES - texts.keys():
                remove(folder / file)
        return [folder / file for file in texts]


def _plain(value: Any) -> Any:
    """Return a value as JSON has it; what is no finite number is None."""
    text = json.dumps(value, default=lambda each: each.item())
    return json.loads(text, parse_constant=lambda _: None)
