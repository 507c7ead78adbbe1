"""The closing table of an evaluation."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from rich.markup import escape
from rich.table import Table

from handrail.datasets.paired import wilson

_HEADINGS = ("arm", "policies", "success", "95 %", "time [s]", "contacts / 100", "brakes / 100", "failures")


def evaluation_table(content: Mapping[str, Any]) -> Table:
    """Return one line an arm: success with its Wilson interval, time to it, contacts, brakes, why it failed.

    Args:
        content: of an evaluation file.
    """
    rollouts = [row for arm in content["arms"].values() for entry in arm for row in entry["rollouts"]]
    table = Table(title=escape(str(content.get("task", ""))), caption=_caption(rollouts))
    for heading in _HEADINGS:
        table.add_column(heading, justify="left" if heading in ("arm", "failures") else "right")
    for label, entries in content["arms"].items():
        rows = [row for entry in entries for row in entry["rollouts"]]
        table.add_row(escape(label), str(len(entries)), *_cells(rows))
    return table


def _cells(rows: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    successes = sum(row["success"] for row in rows)
    low, high = wilson(successes, len(rows))
    times = [row["time_to_success"] for row in rows if "time_to_success" in row]
    reasons = Counter(row.get("failure_reason") or "unknown" for row in rows if not row["success"])
    return (
        f"{successes}/{len(rows)} = {successes / len(rows):.0%}",
        f"{low:.0%} – {high:.0%}",
        f"{np.median(times):.1f}" if times else "–",
        *(f"{100 * np.mean([row.get(name, 0) for row in rows]):.1f}" for name in ("contacts", "brakes")),
        escape(", ".join(f"{reason} {count}" for reason, count in reasons.most_common())) or "none",
    )


def _caption(rows: Sequence[Mapping[str, Any]]) -> str:
    """Say what a step took, and what the intervals leave out."""
    timed = [row["timing"] for row in rows if "timing" in row]
    words = [
        f"{part} {np.median([timing[part] for timing in timed]):.2f} ms"
        for part in ("policy", "controller", "environment")
        if timed
    ]
    said = "time of a step, median: " + ", ".join(words) + "\n" if words else ""
    return said + "intervals of the rollouts alone (Wilson); handrail-compare adds those of training"
