"""Writing a comparison of people: a page, JSON, and two CSV files."""

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from handrail.datasets.comparison.people.contrasts import Contrast
from handrail.datasets.comparison.people.people import PeopleComparison, PeoplePart
from handrail.datasets.comparison.people.tables import people_tables
from handrail.datasets.comparison.report.report import json_text, plain, write_texts
from handrail.datasets.presentation.markup import folded, items, page, paragraph, section
from handrail.datasets.storage.csv_file import csv_text

FORMAT = "handrail.people/1"
_NUMBERS = ("label", "baseline", "count", "estimate", "interval", "p", "p_adjusted", "detected")
_HOW = (
    "A participant's value is the mean over their episodes of a task in a condition. A difference is taken"
    " within each participant, over the scenes that they met under both conditions, else of their means; then"
    " the mean over participants. Intervals are 95 %, by a bootstrap that resamples participants. p:"
    " permutation of the signs of the participants' differences, exact where there are few, adjusted by Holm"
    " over each table. A difference is detected if its interval leaves zero out and p stays below 0.05."
)


def write_people_report(comparison: PeopleComparison) -> list[Path]:
    """Write the report into the folder of its config and return the files."""
    texts = {
        "report.html": people_page(comparison),
        "report.json": json_text(as_json(comparison)),
        "trials.csv": csv_text([plain(row) for row in _trial_rows(comparison)]),
        "differences.csv": _differences_csv(comparison),
    }
    return write_texts(comparison.config.folder, texts)


def people_page(comparison: PeopleComparison) -> str:
    """Return the page."""
    name = comparison.study.root.absolute().name
    said = items(("caution", text) for text in (comparison.study.note, *comparison.cautions) if text)
    meanings = {each.title: each.meaning for part in comparison.parts for each in part.measures}
    told = items(("quiet", f"{title}: {meaning}.") for title, meaning in meanings.items())
    return page(
        f"{name}: people, compared",
        section("", said) if said else "",
        *(section("", table) for table in people_tables(comparison)),
        section("How to read this", paragraph(_HOW), folded("What every measure means", told)),
        what=f"{len(comparison.participants)} participants; baseline {comparison.baseline}",
    )


def as_json(comparison: PeopleComparison) -> dict[str, Any]:
    """Return everything as plain values; what is no number is null."""
    source = comparison.study.source
    return plain(
        {
            "format": FORMAT,
            "source": source,
            "demo": comparison.study.demo,
            "baseline": comparison.baseline,
            "participants": comparison.participants,
            "cautions": comparison.cautions,
            "tables": {part.title: {"source": source} | _part(part) for part in comparison.parts},
        }
    )


def _part(part: PeoplePart) -> dict[str, Any]:
    return {
        "means": {name: [asdict(mean) for mean in means] for name, means in part.means.items()},
        "differences": [_contrast(each) for each in part.contrasts],
    }


def _contrast(each: Contrast) -> dict[str, Any]:
    named = {"measure": each.measure.name, "unit": each.measure.unit}
    return named | {name: getattr(each, name) for name in _NUMBERS}


def _trial_rows(comparison: PeopleComparison) -> Iterator[dict[str, Any]]:
    for each in comparison.trials:
        yield {
            "source": comparison.study.source,
            "task": each.task,
            "condition": each.condition,
            "participant": each.participant,
            "operator": "person" if each.participant else "scripted",
            "scene": each.scene,
            "dataset": each.dataset.name,
            "episode": each.episode,
            **each.values,
        }


def _differences_csv(comparison: PeopleComparison) -> str:
    rows = []
    for part in comparison.parts:
        for each in part.contrasts:
            low, high = each.interval or (None, None)
            row = {"source": comparison.study.source, "table": part.title} | _contrast(each)
            row |= {"interval": None, "interval_low": low, "interval_high": high}
            rows.append({name: value for name, value in plain(row).items() if name != "interval"})
    return csv_text(rows) if rows else "source,table\n"
