"""Writing what was found: a page for people, JSON and CSV for programs."""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from handrail.datasets.comparison.cautions import cautions
from handrail.datasets.comparison.compare import Comparison, EpisodeChoice
from handrail.datasets.comparison.differences import Difference
from handrail.datasets.comparison.headline import headline
from handrail.datasets.comparison.report.page import report_page
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.quality.measure import Measured
from handrail.datasets.storage.atomic import explained, write_whole
from handrail.datasets.storage.csv_file import csv_text

_FIELDS = (
    "estimate",
    "interval",
    "spread",
    "p",
    "p_adjusted",
    "at_length",
    "at_length_interval",
    "follows_length",
)


def write_report(comparison: Comparison) -> list[Path]:
    """Write the report into the folder of its config and return the files."""
    texts = {
        "report.html": report_page(comparison),
        "report.json": json_text(as_json(comparison)),
        "episodes.csv": csv_text([plain(row) for row in _episode_rows(comparison)]),
        "differences.csv": csv_text([plain(row) for row in _difference_rows(comparison)]),
    }
    return write_texts(comparison.config.folder, texts)


def as_json(comparison: Comparison) -> dict[str, Any]:
    """Return everything as plain values; what is no number is null."""
    return plain(
        {
            "format": "handrail.comparison/2",
            "baseline": comparison.baseline,
            "unlike": comparison.unlike,
            "config": asdict(comparison.config),
            "headline": headline(comparison),
            "cautions": cautions(comparison),
            "collection_differences": {
                label: asdict(each) | {"detectable": each.detectable(len(comparison.success))}
                if each
                else None
                for label, each in comparison.success.items()
            },
            "successes_an_hour": {
                "intervals": comparison.rates,
                "ratios": {
                    label: asdict(each) if each else None for label, each in comparison.ratios.items()
                },
            },
            "views": {view.title: _view(view) for view in comparison.views},
            "outcomes": asdict(comparison.outcomes) if comparison.outcomes else None,
        }
    )


def _view(view: EpisodeChoice) -> dict[str, Any]:
    return {
        "collected": {
            each.label: asdict(each) | {"successes_an_hour": each.successes_an_hour}
            for each in view.collected
        },
        "metrics": {
            name: {label: _measured(each) for label, each in groups.items()}
            for name, groups in view.measurements.values.items()
        },
        "differences": [_difference(each) for each in view.differences],
    }


def _measured(each: Measured) -> dict[str, Any]:
    numbers = {"count": len(each.known), "mean": each.mean, "interval": each.interval}
    return numbers | {"reason": each.reason}


def _difference(each: Difference) -> dict[str, Any]:
    known = {"metric": each.metric.name, "group": each.label, "baseline": each.baseline}
    if each.reason:
        return known | {"does_not_apply": each.reason}
    return known | {
        name: getattr(each, name) for name in ("paired", "counts", "tested", *_FIELDS, "detected")
    }


def _episode_rows(comparison: Comparison) -> list[dict[str, Any]]:
    """Return a row an episode: which, how it ended, every metric; empty where one does not apply."""
    view = comparison.everything
    rows = []
    for group in view.groups:
        for place, episode in enumerate(group.episodes):
            row = {"group": group.label, "dataset": group.info.root.name, "episode": episode.number}
            row |= {"success": episode.success}
            values = view.measurements.values
            rows.append(row | {m.name: values[m.name][group.label].values[place] for m in METRICS})
    return rows


def _difference_rows(comparison: Comparison) -> list[dict[str, Any]]:
    rows = []
    for view in comparison.views:
        for each in view.differences:
            numbers = {name: getattr(each, name) for name in _FIELDS} if not each.reason else {}
            row: dict[str, Any] = {"view": view.title, "metric": each.metric.name, "unit": each.metric.unit}
            row |= {"group": each.label, "baseline": each.baseline, "does_not_apply": each.reason}
            for name in _FIELDS:
                value = numbers.get(name)
                if name.endswith("interval"):
                    row[f"{name}_low"], row[f"{name}_high"] = value or (None, None)
                else:
                    row[name] = value
            rows.append(row)
    return rows


def write_texts(folder: Path, texts: Mapping[str, str]) -> list[Path]:
    """Write files of a report by name, and return them."""
    with explained(f"--output {str(folder)!r}: expected a folder that can be written"):
        for name, text in texts.items():
            write_whole(folder / name, text.encode())
    return [folder / name for name in texts]


def json_text(content: Any) -> str:
    """Return content as JSON; what is no finite number is null."""
    return json.dumps(plain(content), indent=1, allow_nan=False) + "\n"


def plain(value: Any) -> Any:
    """Return a value as JSON has it; what is no finite number is None."""
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    if hasattr(value, "item"):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
