"""Every metric of every episode of the groups that are compared, each value or why there is none."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from handrail.controllers.errors import message_of, restated
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.quality.episode_set import EpisodeSet, frames_of
from handrail.datasets.quality.metric import Metric
from handrail.datasets.quality.scale import Scale
from handrail.datasets.quality.units import why_not
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply, Episode
from handrail.datasets.reading.load import each_opened
from handrail.datasets.statistics.contrast import Value, mean_value

FRAMES = 2048  # of a group at most, for what compares every frame with every other

Groups = Mapping[str, Sequence[Episode]]  # by label
Placed = tuple[Episode, list[tuple[EpisodeSet, int]]]  # an episode, the groups that it is in, and its places


@dataclass(frozen=True)
class Measurements:
    """The metrics of some groups."""

    values: Mapping[str, Mapping[str, Value]]
    """By metric and group."""
    groups: Mapping[str, EpisodeSet]
    metrics: Sequence[Metric]
    """Those asked for; of datasets with several hands, those of motion for each hand too."""

    def why_not(self, metric: Metric, one: str, other: str) -> str:
        """Return why a metric's values of two groups cannot be compared; "" if they can."""
        first, second = self.groups[one], self.groups[other]
        reason = why_not(metric.needs, first, second)
        apart = metric.needs == "scale" and first.scale is not second.scale
        return reason or ("they were put on different scales" if apart else "")


def measure(
    groups: Groups, rng: np.random.Generator, margin: float = 0.1, metrics: Sequence[Metric] = METRICS
) -> Measurements:
    """Return every metric of every episode; see `measure_views`."""
    return next(measure_views({"": groups}, rng, margin, metrics))


def measure_views(
    views: Mapping[str, Groups],
    rng: np.random.Generator,
    margin: float = 0.1,
    metrics: Sequence[Metric] = METRICS,
) -> Iterator[Measurements]:
    """Yield the metrics of several ways to choose episodes; one that is in several is read once for all.

    Args:
        views: Groups of episodes, by title.
        rng: Of intervals and of what is estimated from random batches; drawn from as the views are asked for.
        margin: Distance to keep [m].
        metrics: Which; those of motion also of each hand, where there are several.
    """
    sets = [{label: EpisodeSet(each) for label, each in groups.items()} for groups in views.values()]
    metrics = _by_hand(metrics, sets[0].values())
    for groups in sets:
        _share_scales(list(groups.values()), margin)
    placed = _placed([group for groups in sets for group in groups.values()])
    if any(metric.needs for metric in metrics):
        for episode, where in _each(placed):
            for scale in {group.scale for group, _ in where}:
                scale.add(episode)
    whole = any(metric.of_dataset for metric in metrics)
    for episode, where in _each(placed):
        modes = set(np.unique(episode.column("mode")).tolist()) if episode.has("mode") else set()
        for group, place in where:
            group.modes |= modes
            if whole and len(group.frames[place]):
                group.excerpts[place] = episode.some(group.frames[place])
        for metric in metrics:
            if not metric.of_dataset:
                _measure(metric, episode, where)
    for title, groups in zip(views, sets, strict=True):
        values = {
            each.name: {label: _value(each, label, title, group, rng) for label, group in groups.items()}
            for each in metrics
        }
        yield Measurements(values, groups, metrics)


def _by_hand(metrics: Sequence[Metric], groups: Iterable[EpisodeSet]) -> list[Metric]:
    """Return metrics, and behind those of motion the same of each hand that is told apart."""
    hands = dict.fromkeys(hand for group in groups for hand in group.first.hands)
    own = ((each, *(map(each.of_hand, hands) if each.is_of_motion else ())) for each in metrics)
    return [each for found in own for each in found]


def _share_scales(groups: Sequence[EpisodeSet], margin: float) -> None:
    """Give groups that can be compared one scale.

    The smallest says how many frames of each stand for it, for what compares every frame with every other.
    """
    families: list[list[EpisodeSet]] = []
    for group in groups:
        fitting = (family for family in families if not why_not("scale", family[0], group))
        family = next(fitting, [])
        family.append(group)
        families += [family] if len(family) == 1 else []
    for family in families:
        scale, lengths = Scale(margin), [[each.count for each in group.episodes] for group in family]
        most = min(FRAMES, *map(sum, lengths))
        for group, counts in zip(family, lengths, strict=True):
            group.scale, group.frames = scale, frames_of(counts, most)


def _placed(groups: Sequence[EpisodeSet]) -> list[Placed]:
    found: dict[int, Placed] = {}
    for group in groups:
        for place, episode in enumerate(group.episodes):
            found.setdefault(id(episode), (episode, []))[1].append((group, place))
    return list(found.values())


def _each(placed: Sequence[Placed]) -> Iterator[tuple[Demonstration, list[tuple[EpisodeSet, int]]]]:
    opened = each_opened(episode for episode, _ in placed)
    return zip(opened, (where for _, where in placed), strict=True)


def _measure(metric: Metric, episode: Demonstration, where: Sequence[tuple[EpisodeSet, int]]) -> None:
    """Measure an episode, once for all groups unless it hangs on their scale."""
    known: dict[Scale | None, float | str] = {}
    for group, place in where:
        key = group.scale if metric.needs == "scale" else None
        if key not in known:
            with restated(f"metric {metric.name} of episode {episode.number}"):
                try:
                    known[key] = float(metric.measure(episode, group.scale))
                except DoesNotApply as error:
                    known[key] = str(error)
        group.found.setdefault(metric.name, [np.nan] * len(group.episodes))[place] = known[key]


def _value(metric: Metric, label: str, scope: str, group: EpisodeSet, rng: np.random.Generator) -> Value:
    if metric.of_dataset:
        return _of_dataset(metric, label, scope, group, rng)
    found = group.found[metric.name]
    values = np.array([np.nan if isinstance(each, str) else each for each in found])
    reasons = Counter(each for each in found if isinstance(each, str)).most_common(1)
    return mean_value(metric, label, values, rng, scope=scope, reason=reasons[0][0] if reasons else "")


def _of_dataset(metric: Metric, label: str, scope: str, group: EpisodeSet, rng: np.random.Generator) -> Value:
    """Return the mean over the frames, and that of each episode, NaN where it has none."""
    count, ask = len(group.episodes), partial(mean_value, metric, label, rng=None, scope=scope)
    try:
        values = np.asarray(metric.measure(group, rng), float)
        known, owner = np.isfinite(values), group.owner
        counts = np.bincount(owner[known], minlength=count)
        sums = np.bincount(owner[known], weights=values[known], minlength=count)
    except Exception as error:  # also whatever another package's code raises; the other metrics go on
        failed = f"{metric.measure.__module__}:{metric.name} failed: {message_of(error)}"
        reason = str(error) if isinstance(error, DoesNotApply) else failed
        return ask(np.full(count, np.nan), reason=reason)
    means = np.divide(sums, counts, out=np.full(count, np.nan), where=counts > 0)
    return replace(ask(means), estimate=float(values[known].mean()) if known.any() else None)
