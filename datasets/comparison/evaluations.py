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

from collections.abc import Iterable, Mapping
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

    def runs(self, outcome: str = SUCCESS) -> list[Run]:
        """Return one outcome of all policies."""
        found = []
        for policy in self.policies:
            seeds = tuple(sorted(policy.rollouts))
            values = np.array([policy.rollouts[seed][outcome] for seed in seeds], float)
            found.append(Run(*policy.key, seeds, values))
        return found


def read_evaluations(paths: Iterable[str | Path]) -> dict[str, Condition]:
    """Return the conditions of evaluation files by label, in the order in which they come."""
    policies: dict[str, dict[tuple[int, int], Policy]] = {}
    for path in map(Path, paths):
        for label, entries in _content(path)["arms"].items():
            where = f"evaluations {str(path)!r}: condition {label!r}"
            _add_all(policies.setdefault(label, {}), entries, where)
    return {label: Condition(label, tuple(known.values())) for label, known in policies.items()}


def _add_all(known: dict[tuple[int, int], Policy], entries: Any, where: str) -> None:
    if not isinstance(entries, list) or not entries:
        raise HandrailError(f"{where}: expected a list of trained policies, got {type(entries).__name__}")
    try:
        for entry in entries:
            _add(known, entry, where)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise HandrailError(
            f"{where}: expected 'training_seed' and 'rollouts' with 'seed' and 'success', got {error!r}"
        ) from error


def _add(known: dict[tuple[int, int], Policy], entry: dict[str, Any], where: str) -> None:
    """Add a policy's rollouts to those known of it."""
    trained_on = {name: float(value) for name, value in (entry.get("trained_on") or {}).items()}
    policy = Policy(int(entry.get("dataset_draw", 0)), int(entry["training_seed"]), trained_on, {})
    rollouts = dict(known.get(policy.key, policy).rollouts)
    for rollout in entry["rollouts"]:
        seed = int(rollout["seed"])
        if seed in rollouts:
            raise HandrailError(
                f"{where}, training seed {policy.training_seed}: the rollout with seed {seed} comes twice"
            )
        rollouts[seed] = _outcomes(rollout, where)
    if not entry["rollouts"]:
        raise HandrailError(f"{where}: expected one rollout or more, got none")
    known[policy.key] = replace(known.get(policy.key, policy), rollouts=rollouts)


def _outcomes(rollout: Mapping[str, Any], where: str) -> dict[str, float]:
    if not isinstance(rollout[SUCCESS], bool):
        raise HandrailError(f"{where}: expected 'success' true or false, got {rollout[SUCCESS]!r}")
    numbers = {name: value for name, value in rollout.items() if isinstance(value, bool | int | float)}
    return {name: float(value) for name, value in numbers.items() if name != "seed"}


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
