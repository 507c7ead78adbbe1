"""The closing table of an evaluation."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from handrail.datasets.presentation.table import Table
from handrail.datasets.statistics.paired import wilson

_HEADINGS = (
    "condition",
    "policies",
    "success",
    "95 %",
    "time [s]",
    "contacts / 100",
    "brakes / 100",
    "failures",
)


def evaluation_table(content: Mapping[str, Any]) -> Table:
    """Return a line a condition: success with its Wilson interval, time to it, contacts, brakes, why not.

    Args:
        content: of an evaluation file.
    """
    rollouts = [row for entries in content["arms"].values() for entry in entries for row in entry["rollouts"]]
    lines = [
        (label, str(len(entries)), *_cells([row for entry in entries for row in entry["rollouts"]]))
        for label, entries in content["arms"].items()
    ]
    return Table(_HEADINGS, lines, str(content.get("task", "")), _caption(rollouts))


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
        ", ".join(f"{reason} {count}" for reason, count in reasons.most_common()) or "none",
    )


def _caption(rows: Sequence[Mapping[str, Any]]) -> str:
    """Say what a step took, and what the intervals leave out."""
    timed = [row["timing"] for row in rows if "timing" in row]
    words = [
        f"{part} {np.median([timing[part] for timing in timed]):.2f} ms"
        for part in ("policy", "controller", "environment")
        if timed
    ]
    said = f"time of a step, median: {', '.join(words)}; " if words else ""
    return said + "intervals of the rollouts alone (Wilson); handrail-compare adds those of training"
