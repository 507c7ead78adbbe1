"""The tables of a comparison of people; what is above each says where no people took part."""

from collections.abc import Iterator

from handrail.datasets.comparison.people.contrasts import Contrast, Mean
from handrail.datasets.comparison.people.measures import SHARES
from handrail.datasets.comparison.people.people import PeopleComparison, PeoplePart
from handrail.datasets.presentation.table import Cell, Table
from handrail.datasets.presentation.wording import (
    DASH,
    number,
    p_alone,
    percent,
    percent_span,
    points,
    points_span,
    signed,
    span,
)
from handrail.datasets.quality.metric import Metric

_MEANS = "Means over participants; 95 % below, by resampling participants; n: who has a value, of all."
_CONTRASTS = "Differences within participants; p after Holm over this table; bold: detected."


def people_tables(comparison: PeopleComparison) -> Iterator[Table]:
    """Yield the tables of every part: means, then differences."""
    for part in comparison.parts:
        yield means_table(part, comparison.study.note)
        if part.contrasts:
            yield contrasts_table(part, comparison)


def means_table(part: PeoplePart, note: str) -> Table:
    """Return every measure under every condition.

    Args:
        part: a task, or the forms.
        note: what is said above it.
    """
    (first, *_) = part.means.values()
    labels = [f"{mean.label}, scripted" if mean.scripted else mean.label for mean in first]
    rows = [[_name(each), *(_mean(mean, each) for mean in part.means[each.name])] for each in part.measures]
    return Table(("", *labels), rows, _title(note, part.title), _MEANS)


def contrasts_table(part: PeoplePart, comparison: PeopleComparison) -> Table:
    """Return every condition's difference to the baseline."""
    headings = ("", "condition", f"minus {comparison.baseline}", "95 %", "p, Holm", "n")
    rows = [
        [
            _name(each.measure),
            each.label,
            _estimate(each),
            _interval(each),
            p_alone(each.p_adjusted),
            str(each.count),
        ]
        for each in part.contrasts
    ]
    title = f"{part.title}: against {comparison.baseline}, paired by participant"
    return Table(headings, rows, _title(comparison.study.note, title), _CONTRASTS)


def _title(note: str, title: str) -> str:
    return f"{note}. {title}" if note else title


def _name(measure: Metric) -> Cell:
    unit = "" if measure.name in SHARES else measure.unit
    judged = f"{measure.good} is better" if measure.good else ""
    return Cell(measure.title, "", measure.meaning, " · ".join(part for part in (unit, judged) if part))


def _mean(mean: Mean, measure: Metric) -> Cell:
    if mean.mean is None:
        return Cell("missing", "quiet", below=f"n = 0 of {mean.total}")
    share = measure.name in SHARES
    told = percent_span(mean.interval) if share else span(mean.interval)
    of = f"n = {mean.count} of {mean.total}"
    below = f"{told}; {of}" if mean.interval else of
    return Cell(percent(mean.mean) if share else number(mean.mean), below=below)


def _estimate(each: Contrast) -> Cell:
    if each.estimate is None:
        return Cell("missing", "quiet")
    share = each.measure.name in SHARES
    text = f"{points(each.estimate)} points" if share else signed(each.estimate)
    return Cell(text, "detected" if each.detected else "")


def _interval(each: Contrast) -> str:
    if each.interval is None:
        return DASH
    return points_span(each.interval) if each.measure.name in SHARES else span(each.interval)
