"""What policies trained on the datasets did, read from JSON files; the schema is below.

    {
      "format": "handrail.evaluations/1",
      "task": "reach",                              what was evaluated, optional
      "arms": {
        "ee": [                                     a dataset's or a mode's label
          {
            "training_seed": 0,
            "dataset_draw": 0,                      which resample of the dataset, optional
            "trained_on": {"episodes": 50, "operator_time": 312.5},     optional, [s]
            "rollouts": [{"seed": 1000, "success": true, "contacts": 0, "length": 4.2}, …]
          }, …
        ], …
      }
    }

A rollout needs `seed` and `success`; other numbers (`contacts`, `length` [s], …) are outcomes too, reported
where every rollout of a condition has them. Several files add up; the same rollout twice is an error.
"""

from collections.abc import Iterable, Mapping, Set
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from handrail.controllers.errors import HandrailError
from handrail.datasets.statistics.resampling import Run
from handrail.datasets.storage.strict_json import read_json

FORMAT = "handrail.evaluations/1"
SUCCESS = "success"


@dataclass(frozen=True)
class Policy:
    """One trained policy and what it did.

    Attributes:
        draw: Which draw of the dataset it was trained on.
        training_seed: Of its training.
        trained_on: Numbers about the data, such as `episodes` and `operator_time`.
        rollouts: By evaluation seed, each outcome's value by name.
    """

    draw: int
    training_seed: int
    trained_on: Mapping[str, float]
    rollouts: Mapping[int, Mapping[str, float]]

    @property
    def key(self) -> tuple[int, int]:
        """Draw of the dataset and training seed."""
        return self.draw, self.training_seed

    def run(self, outcome: str) -> Run:
        """Return one outcome of all rollouts."""
        seeds = tuple(sorted(self.rollouts))
        values = np.array([self.rollouts[seed][outcome] for seed in seeds], float)
        return Run(self.draw, self.training_seed, seeds, values)


@dataclass(frozen=True)
class Condition:
    """All policies of one dataset or mode.

    Attributes:
        label: Its name.
        policies: In the order of the files.
    """

    label: str
    policies: tuple[Policy, ...]

    @property
    def outcomes(self) -> tuple[str, ...]:
        """Outcomes that every rollout has, success first."""
        rollouts = [rollout for policy in self.policies for rollout in policy.rollouts.values()]
        common = set.intersection(*(set(rollout) for rollout in rollouts))
        return (SUCCESS, *sorted(common - {SUCCESS}))

    @property
    def rollouts(self) -> frozenset[tuple[int, int, int]]:
        """Draw, training seed and evaluation seed of every rollout."""
        return frozenset((*each.key, seed) for each in self.policies for seed in each.rollouts)

    def only(self, rollouts: Set[tuple[int, int, int]]) -> "Condition | None":
        """Return the condition with some of its rollouts; None if it has none of these.

        Args:
            rollouts: Draw, training seed and evaluation seed of each.
        """
        fewer = [
            replace(each, rollouts={k: v for k, v in each.rollouts.items() if (*each.key, k) in rollouts})
            for each in self.policies
        ]
        kept = tuple(each for each in fewer if each.rollouts)
        return Condition(self.label, kept) if kept else None

    def runs(self, outcome: str = SUCCESS) -> list[Run]:
        """Return one outcome of all policies."""
        return [policy.run(outcome) for policy in self.policies]


def read_evaluations(paths: Iterable[str | Path]) -> dict[str, Condition]:
    """Return the conditions of evaluation files by label, in the order in which they come.

    Raises:
        HandrailError: A file is not there or is none of these, or a rollout comes twice.
    """
    policies: dict[str, dict[tuple[int, int], Policy]] = {}
    for path in map(Path, paths):
        for label, entries in _content(path)["arms"].items():
            known = policies.setdefault(label, {})
            for policy in _policies(path, label, entries):
                _add(known, policy, f"{str(path)!r}: condition {label!r}")
    return {label: Condition(label, tuple(known.values())) for label, known in policies.items()}


def _add(known: dict[tuple[int, int], Policy], policy: Policy, where: str) -> None:
    key = policy.key
    before = known.get(key)
    if before is None:
        known[key] = policy
        return
    twice = set(before.rollouts) & set(policy.rollouts)
    if twice:
        raise HandrailError(
            f"{where}, training seed {key[1]}: the rollout with seed {min(twice)} comes twice"
        )
    known[key] = Policy(*key, before.trained_on, {**before.rollouts, **policy.rollouts})


def _content(path: Path) -> dict[str, Any]:
    try:
        content = read_json(path.expanduser())
    except FileNotFoundError as error:
        raise HandrailError(f"evaluations {str(path)!r}: expected a JSON file, found none") from error
    except (OSError, ValueError) as error:
        raise HandrailError(f"evaluations {str(path)!r}: expected a JSON file, got {error}") from error
    given = content.get("format") if isinstance(content, dict) else None
    if given != FORMAT:
        raise HandrailError(f"evaluations {str(path)!r}: expected the format {FORMAT!r}, got {given!r}")
    if not isinstance(content.get("arms"), dict) or not content["arms"]:
        raise HandrailError(f"evaluations {str(path)!r}: expected 'arms' with one label or more")
    return content


def _policies(path: Path, label: str, entries: Any) -> list[Policy]:
    where = f"evaluations {str(path)!r}: condition {label!r}"
    if not isinstance(entries, list) or not entries:
        raise HandrailError(f"{where}: expected a list of trained policies, got {type(entries).__name__}")
    try:
        return [_policy(entry, where) for entry in entries]
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise HandrailError(
            f"{where}: expected 'training_seed' and 'rollouts' with 'seed' and 'success', got {error!r}"
        ) from error


def _policy(entry: dict[str, Any], where: str) -> Policy:
    rollouts: dict[int, dict[str, float]] = {}
    for rollout in entry["rollouts"]:
        seed = int(rollout["seed"])
        if seed in rollouts:
            raise HandrailError(f"{where}: the rollout with seed {seed} comes twice")
        if not isinstance(rollout[SUCCESS], bool):
            raise HandrailError(f"{where}: expected 'success' true or false, got {rollout[SUCCESS]!r}")
        rollouts[seed] = {
            name: float(value)
            for name, value in rollout.items()
            if name != "seed" and isinstance(value, bool | int | float)
        }
    if not rollouts:
        raise HandrailError(f"{where}: expected one rollout or more, got none")
    trained_on = {name: float(value) for name, value in (entry.get("trained_on") or {}).items()}
    return Policy(int(entry.get("dataset_draw", 0)), int(entry["training_seed"]), trained_on, rollouts)
