"""The whole comparison: read, measure, judge."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.collection import (
    Collected,
    RateRatio,
    collected,
    matched_number,
    matched_time,
    rate_interval,
    rate_ratio,
    success_difference,
)
from handrail.datasets.comparison.config import CompareConfig
from handrail.datasets.comparison.differences import Difference, differences
from handrail.datasets.comparison.evaluations import Condition, read_evaluations
from handrail.datasets.comparison.groups import Group, baseline_of, group_of, load_groups, unlike
from handrail.datasets.comparison.outcomes import LIKE_FOR_LIKE, Outcomes, Pair, judge_pairs
from handrail.datasets.quality.group_reading import GroupReading
from handrail.datasets.quality.measure import Measurements, measured, read
from handrail.datasets.reading.check import check_whole
from handrail.datasets.statistics.proportions import ShareDifference
from handrail.datasets.statistics.resampling import Interval

MIXED = "mixed"  # family of policies that differ in more than their data
_SAME_NUMBER = "the same number of episodes"


@dataclass(frozen=True)
class EpisodeChoice:
    """One way to choose the episodes that are compared.

    Attributes:
        title: What is held equal.
        groups: The episodes chosen.
        collected: What they consist of; failures are counted even where quality is measured without.
        measurements: Of their quality.
        differences: Of every metric, each group against the baseline.
    """

    title: str
    groups: Sequence[Group]
    collected: Sequence[Collected]
    measurements: Measurements
    differences: Sequence[Difference]


@dataclass(frozen=True)
class Comparison:
    """What was found.

    Attributes:
        config: What was asked.
        baseline: The label that the others are compared with.
        views: All episodes, as many of each, as much operator time of each.
        success: In collection: each group's difference to the baseline, None where it was not recorded.
        rates: Each group's interval of successes an hour, None where it cannot be told.
        ratios: Successes an hour of each group over those of the baseline.
        outcomes: Of trained policies, if evaluations were given.
    """

    config: CompareConfig
    baseline: str
    views: Sequence[EpisodeChoice]
    success: Mapping[str, ShareDifference | None]
    rates: Mapping[str, Interval | None]
    ratios: Mapping[str, RateRatio | None]
    outcomes: Outcomes | None

    @property
    def everything(self) -> EpisodeChoice:
        """The view of all episodes."""
        return self.views[0]

    @property
    def same_number(self) -> EpisodeChoice:
        """The view of as many episodes of each group."""
        return self.views[1]

    @property
    def labels(self) -> list[str]:
        """Labels of the groups."""
        return [group.label for group in self.everything.groups]

    @property
    def unlike(self) -> tuple[str, ...]:
        """What differs so that nothing is ranked: tasks, robots."""
        return unlike(self.everything.groups)


def compare(config: CompareConfig) -> Comparison:
    """Compare as configured."""
    config.check()
    for root in config.datasets:
        check_whole(root, config.verify)
    groups = load_groups(config.datasets, config.by, config.labels, config.columns)
    baseline = baseline_of(groups, config.baseline)
    conditions = _conditions(config, groups)
    pairs = pairs_between(list(conditions), baseline, [group.label for group in groups])
    rng = np.random.default_rng(config.seed)
    chosen = {
        "all episodes": groups,
        _SAME_NUMBER: matched_number(groups),
        "the same operator time": matched_time(groups),
    }
    counted = {title: _counted(title, each, config) for title, each in chosen.items()}
    readings = read(
        [{group.label: group.episodes for group in each} for each in counted.values()], config.margin
    )
    views = [
        _view(title, chosen[title], counted[title], each, baseline, rng)
        for title, each in zip(chosen, readings, strict=True)
    ]
    (base,) = [group for group in groups if group.label == baseline]
    others = [group for group in groups if group is not base]
    success = {group.label: success_difference(group, base) for group in others}
    rates = {group.label: rate_interval(group, rng) for group in groups}
    ratios = {group.label: rate_ratio(group, base, rng) for group in others}
    outcomes = judge_pairs(conditions, pairs, rng) if conditions else None
    return Comparison(config, baseline, views, success, rates, ratios, outcomes)


def _counted(title: str, groups: Sequence[Group], config: CompareConfig) -> list[Group]:
    """Return the episodes of which quality is measured."""
    counted = [group.successful() for group in groups] if config.success_only else list(groups)
    for group in counted:
        if not group.episodes:
            raise HandrailError(f"--success_only: {group.label!r} has no successful episode among {title}")
    if title == _SAME_NUMBER:  # of those that count; as many were collected
        return matched_number(counted)
    return counted


def _view(
    title: str,
    groups: Sequence[Group],
    counted: Sequence[Group],
    readings: Mapping[str, GroupReading],
    baseline: str,
    rng: np.random.Generator,
) -> EpisodeChoice:
    measurements = measured(readings, rng)
    found = differences(counted, measurements, baseline, rng)
    return EpisodeChoice(title, counted, [collected(group) for group in groups], measurements, found)


def _conditions(config: CompareConfig, groups: Sequence[Group]) -> dict[str, Condition]:
    """Return the evaluations' conditions; each must say which group its policies were trained on."""
    conditions = read_evaluations(config.evaluations)
    labels = [group.label for group in groups]
    for label in conditions:
        if not group_of(label, labels):
            raise HandrailError(
                f"evaluations: unknown condition {label!r}, expected one of {', '.join(labels)},"
                " or one of these with more after a space"
            )
    return conditions


def pairs_between(conditions: Sequence[str], baseline: str, labels: Sequence[str]) -> list[Pair]:
    """Return each condition of another group with that of the baseline's group it is compared with.

    That is the one that shares most of the words after the label and has none of its own: `ee intent same
    number` is set against `direct same number`, not `direct`. Like for like are those with the same words. A
    single condition is compared with nothing.
    """
    words = {
        condition: set(condition.removeprefix(group_of(condition, labels)).strip(" /").split())
        for condition in conditions
    }
    candidates = [condition for condition in conditions if group_of(condition, labels) == baseline]
    found = []
    for condition in conditions if len(conditions) > 1 else ():
        fitting = [each for each in candidates if words[each] <= words[condition]]
        if condition not in candidates and not fitting:
            raise HandrailError(
                f"evaluations: expected a condition {baseline!r} to compare {condition!r} with, got "
                f"{', '.join(conditions)}; name another --baseline"
            )
        if condition not in candidates:
            other = max(fitting, key=lambda each: len(words[each]))
            found.append(Pair(condition, other, LIKE_FOR_LIKE if words[other] == words[condition] else MIXED))
    return found
