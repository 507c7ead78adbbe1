"""The file that an evaluation writes, `handrail.evaluations/1`, and goes on from; and its table."""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.evaluations import FORMAT, MOST_BYTES, read_evaluations
from handrail.datasets.presentation.table import Table
from handrail.datasets.statistics.paired import wilson
from handrail.datasets.statistics.proportions import independent_trials
from handrail.datasets.storage.atomic import explained, write_whole
from handrail.datasets.storage.strict_json import read_json
from handrail.policies.imitation.evaluation.conditions import PolicyCondition

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


class EvaluationFile:
    """The rollouts of all policies under all conditions, in memory and on the disk.

    Beside what `handrail-compare` reads it says of each label under which `conditions` it ran, and of each
    policy which `checkpoint` it was, so that nothing of another kind is added to it later.

    Args:
        path: of the file; None keeps everything in memory.
        conditions: to be run; they must fit what is there.
    """

    def __init__(self, path: Path | None, conditions: Sequence[PolicyCondition]) -> None:
        self._path = path
        self.content: dict[str, Any] = {"format": FORMAT, "conditions": {}, "arms": {}}
        if path is not None and path.exists():
            read_evaluations([path])
            self.content |= read_json(path, MOST_BYTES)
        task = self.content.setdefault("task", conditions[0].checkpoint.meta.environment)
        told = {label: self.content["conditions"].get(label) for label in self.content["arms"]}
        for condition in conditions:
            label, checkpoint = condition.label, condition.checkpoint
            where = f"{f'--json {path}: ' if path else ''}condition {label!r}"
            if checkpoint.meta.environment != task:
                raise HandrailError(f"{where}: expected task {task}, got {checkpoint.meta.environment}")
            here = condition.conditions
            if (before := told.setdefault(label, here)) != here:
                raise HandrailError(f"{where}: expected {before}, got {here}; evaluate it by another --label")
            if any(entry.get("checkpoint") != checkpoint.digest for entry in self._entries(condition)):
                raise HandrailError(f"{where}: has another policy of dataset draw, seed {checkpoint.key}")

    def done(self, condition: PolicyCondition) -> set[int]:
        """Return the seeds that have been run."""
        return {row["seed"] for entry in self._entries(condition) for row in entry["rollouts"]}

    def add(self, condition: PolicyCondition, row: dict[str, Any]) -> None:
        """Add a rollout; they are kept in the order of their seeds."""
        entries, checkpoint = self._entries(condition), condition.checkpoint
        if not entries:
            draw, seed = checkpoint.key
            entry = {
                "training_seed": seed,
                "dataset_draw": draw,
                "trained_on": dict(checkpoint.meta.trained_on),
                "checkpoint": checkpoint.digest,
                "rollouts": [],
            }
            entries.append(entry)
            self.content["conditions"][condition.label] = condition.conditions
            self.content["arms"].setdefault(condition.label, []).append(entry)
        entries[0]["rollouts"].append(row)
        entries[0]["rollouts"].sort(key=lambda rollout: rollout["seed"])

    def save(self) -> None:
        """Write everything, so that a reader sees the old file or the new one, whole."""
        if self._path is not None and self.content["arms"]:
            with explained(f"--json {self._path}"):
                write_whole(self._path, (json.dumps(self.content, indent=1, allow_nan=False) + "\n").encode())

    def _entries(self, condition: PolicyCondition) -> list[dict[str, Any]]:
        """Return what there is of a policy: one entry, or more of them in a file put together by hand."""
        known = self.content["arms"].get(condition.label, ())
        return [entry for entry in known if _key(entry) == condition.checkpoint.key]


def _key(entry: Mapping[str, Any]) -> tuple[int, int]:
    return entry.get("dataset_draw", 0), entry["training_seed"]


def evaluation_table(content: Mapping[str, Any]) -> Table:
    """Return a line a condition: success with its Wilson interval, time to it, contacts, brakes, why not.

    Args:
        content: of an evaluation file.
    """
    rollouts = [row for entries in content["arms"].values() for entry in entries for row in entry["rollouts"]]
    lines = [(label, *_cells(entries)) for label, entries in content["arms"].items()]
    return Table(_HEADINGS, lines, str(content.get("task", "")), _caption(rollouts))


def _cells(entries: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    rows = [row for entry in entries for row in entry["rollouts"]]
    succeeded = np.array([float(row["success"]) for row in rows])
    worth = independent_trials(succeeded, [row["seed"] for row in rows])
    low, high = wilson(succeeded.mean() * worth, worth)
    times = [row["time_to_success"] for row in rows if "time_to_success" in row]
    reasons = Counter(row.get("failure_reason") or "unknown" for row in rows if not row["success"])
    return (
        str(len(set(map(_key, entries)))),
        f"{succeeded.sum():.0f}/{len(rows)} = {succeeded.mean():.0%}",
        f"{low:.0%} – {high:.0%}",
        f"{np.median(times):.1f}" if times else "–",
        *(f"{100 * np.mean([row.get(name) or 0 for row in rows]):.1f}" for name in ("contacts", "brakes")),
        ", ".join(f"{reason} {count}" for reason, count in reasons.most_common()) or "none",
    )


def _caption(rows: Sequence[Mapping[str, Any]]) -> str:
    """Say what a step took, and what the intervals leave out."""
    timed = [row["timing"] for row in rows if row.get("timing")]
    words = [
        f"{part} {np.median([timing[part] for timing in timed]):.2f} ms"
        for part in ("policy", "controller", "environment")
        if timed
    ]
    said = f"time of a step, median: {', '.join(words)}; " if words else ""
    return said + "intervals of the rollouts alone (Wilson); handrail-compare adds those of training"
