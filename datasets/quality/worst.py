"""The worst episodes of a dataset by a metric, and the command that leaves them out."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError, unknown_name
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.quality.measure import measure
from handrail.datasets.quality.metric import Metric
from handrail.datasets.reading.demonstration import Episode
from handrail.datasets.reading.load import some_recorded
from handrail.datasets.reading.reader import DatasetInfo

RANKING = {metric.name: metric for metric in METRICS if metric.good}
"""The metrics of which one end is better, by name."""


@dataclass(frozen=True)
class Ranked:
    """An episode and its value of a metric."""

    episode: Episode
    value: float


def ranking_metric(name: str) -> Metric:
    """Return a metric by its name; of motion also one hand's alone, `left.sparc`."""
    if name in RANKING:
        return RANKING[name]
    hand, _, own = name.partition(".")
    if own not in RANKING or not RANKING[own].is_of_motion:
        raise unknown_name("metric", name, RANKING)
    return RANKING[own].of_hand(hand)


def worst_episodes(root: str | Path, metric: Metric, count: int) -> list[Ranked]:
    """Return the worst episodes of any LeRobot v3.0 dataset, the worst first."""
    if count < 1:
        raise HandrailError(f"--count {count}: expected 1 or more")
    episodes = some_recorded(root)
    measured = measure({"": episodes}, np.random.default_rng(0), metrics=[metric]).values[metric.name][""]
    if measured.estimate is None:
        raise HandrailError(f"--worst {metric.name}: expected a value, got none: {measured.reason}")
    return ranked(episodes, metric, measured.values)[:count]


def ranked(episodes: Sequence[Episode], metric: Metric, values: FloatArray) -> list[Ranked]:
    """Return episodes from the worst to the best by their values, `(E,)`; those with NaN are left out."""
    pairs = zip(episodes, values, strict=True)
    known = [Ranked(episode, float(value)) for episode, value in pairs if np.isfinite(value)]
    sign = 1.0 if metric.good == "higher" else -1.0
    return sorted(known, key=lambda each: (sign * each.value, each.episode.number))


def deletion(info: DatasetInfo, numbers: Sequence[int]) -> str:
    """Return the command that writes a dataset without some of its episodes."""
    numbers = sorted(numbers)
    root, new = shlex.quote(str(info.root)), shlex.quote(f"{info.root}_kept")
    if info.from_handrail:
        return f"handrail-edit delete {root} --episodes {','.join(map(str, numbers))} --output {new}"
    return (
        f"lerobot-edit-dataset --repo_id {shlex.quote(info.root.name)} --root {root} --new_root {new}"
        f" --operation.type delete_episodes --operation.episode_indices '{numbers}'"
    )
