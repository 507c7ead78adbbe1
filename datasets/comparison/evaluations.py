"""Evaluations of policies trained on the datasets, read from JSON files; the schema is below.

    {
      "format": "handrail.evaluations/1",
      "task": "reach",                              what was evaluated, optional
      "conditions": {"ee": {"protection": "none"}},  what its rollouts have in common, by label, optional
      "arms": {                                      the conditions
        "ee": [                                     a dataset's or a mode's label
          {
            "training_seed": 0,
            "dataset_draw": 0,                      which resample of the dataset, optional
            "checkpoint": "3f2a",                   which policy it was, optional
            "trained_on": {"episodes": 50, "operator_time": 312.5},     optional, [s]
            "rollouts": [{"seed": 1000, "success": true, "contacts": 0, "length": 4.2}, …]
          }, …
        ], …
      }
    }

A rollout needs `seed` and `success`; other numbers (`contacts`, `length` [s], …) are outcomes too, reported
where every rollout of a condition has them. Several files add up; the same rollout twice is an error, and so
is another task, another policy or anything else in `conditions` under the same label.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean
from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import Meta

from handrail.controllers.errors import HandrailError
from handrail.controllers.typed import check
from handrail.datasets.statistics.resampling import Run
from handrail.datasets.storage.strict_json import load_json

FORMAT = "handrail.evaluations/1"
MOST_BYTES = 512 << 20  # of a file: some 300,000 rollouts that lasted long
SUCCESS = "success"
Rollout = Mapping[str, Any]
OUTCOMES: Mapping[str, Callable[[Rollout], float]] = {
    "contact": lambda row: row.get("contacts", 0) > 0,
    "clean": lambda row: row[SUCCESS] and not row.get("contacts", 0) > 0,
}
"""Measures derived from a rollout's line."""


class _Rollout(msgspec.Struct):
    seed: int
    success: bool


class _Policy(msgspec.Struct):
    training_seed: int
    rollouts: Annotated[list[dict[str, Any]], Meta(min_length=1)]
    dataset_draw: int = 0
    trained_on: dict[str, float] | None = None
    checkpoint: str = ""


_Policies = Annotated[list[_Policy], Meta(min_length=1)]


@dataclass(frozen=True)
class Policy:
    """One trained policy and its rollouts."""

    draw: int  # of the dataset
    training_seed: int
    trained_on: Mapping[str, float]  # numbers about the data, such as `episodes` and `operator_time`
    rollouts: Mapping[int, Rollout]  # lines of the file, by evaluation seed

    def run(self, outcome: str = SUCCESS) -> Run:
        """Return one outcome of all rollouts."""
        seeds, rows = zip(*sorted(self.rollouts.items()), strict=True)
        values = [float(row[outcome] if outcome in row else OUTCOMES[outcome](row)) for row in rows]
        return Run(self.draw, self.training_seed, seeds, np.array(values))


@dataclass(frozen=True)
class Condition:
    """All policies of one dataset or mode, in the order of the files."""

    label: str
    policies: tuple[Policy, ...]

    @property
    def rollouts(self) -> list[Rollout]:
        """The lines of all rollouts."""
        return [rollout for policy in self.policies for rollout in policy.rollouts.values()]

    @property
    def outcomes(self) -> tuple[str, ...]:
        """Outcomes that every rollout has, success first."""
        numbers = [
            {name for name, value in rollout.items() if isinstance(value, bool | int | float)}
            for rollout in self.rollouts
        ]
        return (SUCCESS, *sorted(set.intersection(*numbers) - {SUCCESS, "seed"}))

    @property
    def successes(self) -> int:
        """How many rollouts succeeded."""
        return sum(bool(rollout[SUCCESS]) for rollout in self.rollouts)

    @property
    def content(self) -> dict[str, Any]:
        """The entry in the JSON of a report."""
        learnt = [policy.trained_on for policy in self.policies]
        known = [name for name in learnt[0] if all(name in each for each in learnt)]
        return {
            "label": self.label,
            "successes": self.successes,
            "rollouts": len(self.rollouts),
            "seeds": [float(run.values.mean()) for run in self.runs()],
            "draws": len({policy.draw for policy in self.policies}),
            "trained_on": {name: fmean(each[name] for each in learnt) for name in known},
        }

    def runs(self, outcome: str = SUCCESS) -> list[Run]:
        """Return one outcome of all policies."""
        return [policy.run(outcome) for policy in self.policies]


def read_evaluations(paths: Iterable[str | Path]) -> dict[str, Condition]:
    """Return the conditions of evaluation files by label, in the order in which they come."""
    found: dict[str, dict[tuple[int, int], Policy]] = {}
    kinds = dict[tuple[str, str], Any]()
    for path in map(Path, paths):
        where = f"evaluations {str(path)!r}"
        content = load_json(path.expanduser(), "evaluations of policies", MOST_BYTES)
        given = content.get("format") if isinstance(content, dict) else None
        if given != FORMAT:
            raise HandrailError(f"{where}: expected the format {FORMAT!r}, got {given!r}")
        arms = content.get("arms")
        if not isinstance(arms, dict) or not arms:
            raise HandrailError(f"{where}: expected 'arms' with one label or more")
        under = check(content.get("conditions", {}), dict[str, dict[str, Any]], f"{where}: conditions")
        for label, entries in arms.items():
            of = f"{where}: condition {label!r}"
            for entry in check(entries, _Policies, of):
                policy = f"checkpoint of draw {entry.dataset_draw}, training seed {entry.training_seed}"
                said = {"task": content.get("task", ""), policy: entry.checkpoint} | under.get(label, {})
                for name, value in said.items():
                    if value not in ("", None) and value != (was := kinds.setdefault((label, name), value)):
                        raise HandrailError(f"{of}: expected {name} {was!r} as before, got {value!r}")
                _add(found.setdefault(label, {}), entry, of)
    return {label: Condition(label, tuple(known.values())) for label, known in found.items()}


def _add(known: dict[tuple[int, int], Policy], entry: _Policy, where: str) -> None:
    """Add a policy's rollouts to those known of it."""
    key = entry.dataset_draw, entry.training_seed
    rollouts = dict(known[key].rollouts) if key in known else {}
    for row in entry.rollouts:
        seed = check(row, _Rollout, f"{where}, a rollout").seed
        if seed in rollouts:
            raise HandrailError(f"{where}, training seed {key[1]}: the rollout with seed {seed} comes twice")
        rollouts[seed] = row
    trained_on = known[key].trained_on if key in known else entry.trained_on or {}
    known[key] = Policy(*key, trained_on, rollouts)
