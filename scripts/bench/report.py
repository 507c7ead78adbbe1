"""What all benches share: the flags that say where results go, the JSON, the tables, the part of a page."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from handrail.collect.flags import check_json, check_page
from handrail.controllers.typed import check_settings
from handrail.datasets.presentation.markdown import markdown_table, write_part
from handrail.datasets.presentation.table import Table
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.storage.strict_json import write_json

PROGRAM = "python -m handrail.scripts.bench"
SPREAD = ("median_ms", "p95_ms", "p99_ms", "worst_ms")


@dataclass(frozen=True, kw_only=True)
class ReportConfig:
    """Where results go."""

    json: str = ""
    """Write everything measured to this file."""
    page: str = ""
    """Put the results into this Markdown page, between marks; other text stays."""

    def check(self) -> None:
        """Check what can be checked without loading anything heavy."""
        check_settings(self, "--")
        check_json(self.json)
        check_page(self.page)


def command_line(name: str, config: Any) -> str:
    """Return the command of a bench that gives these settings: the flags that differ from their defaults."""
    words = [PROGRAM, name]
    for entry in fields(config):
        value = getattr(config, entry.name)
        if isinstance(value, bool) and value != entry.default:
            words.append("--" + ("" if value else "no_") + entry.name)
        elif value != entry.default:
            words.append(f"--{entry.name} {value}")
    return " ".join(words)


def report(
    name: str,
    config: ReportConfig,
    tables: Sequence[Table],
    results: dict[str, Any] | None = None,
    parts: Sequence[str] = (),
) -> None:
    """Print tables, write the JSON and the part of the page, and print which files were written.

    Args:
        name: of the bench.
        config: of the run.
        tables: to print.
        results: for the JSON; None where it is written already.
        parts: paragraphs of the page under the command; the tables with their captions when empty.
    """
    console = Terminal()
    console.print(*tables, sep="\n")
    if config.json and results is not None:
        write_json(Path(config.json).expanduser(), results)
    if config.page:
        own = [part for table in tables for part in (markdown_table(table), table.caption)]
        body = [f"`{command_line(name, config)}` wrote this.", *(parts or own)]
        write_part(Path(config.page).expanduser(), name, name, "\n\n".join(dict.fromkeys(filter(None, body))))
    for path in filter(None, (config.json, config.page)):
        console.print(f"Written: {path}")


def machine(load_before: float) -> dict[str, Any]:
    """Return how many cores there are, and the load before and now."""
    return {"cores": os.cpu_count(), "load_before": load_before, "load_after": os.getloadavg()[0]}


def spread(seconds: Sequence[float], names: Sequence[str] = SPREAD) -> dict[str, float]:
    """Return median, p95, p99 and worst [ms]."""
    return dict(zip(names, np.percentile(1e3 * np.array(seconds), (50, 95, 99, 100)).tolist(), strict=True))
