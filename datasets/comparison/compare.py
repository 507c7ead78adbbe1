"""The comparison of datasets, and of the policies that were trained on them: read, measure, judge."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.collection import (
    collected,
    matched_number,
    matched_time,
    rate_ratio,
    success_difference,
)
from handrail.datasets.comparison.config import CompareConfig
from handrail.datasets.comparison.episodes import differences
from handrail.datasets.comparison.evaluations import Condition, read_evaluations
from handrail.datasets.comparison.groups import Group, baseline_of, group_of, load_groups, unlike
from handrail.datasets.comparison.policies import Outcomes, judge_pairs, pairs_between
from handrail.datasets.presentation.drawing import COLOURS
from handrail.datasets.quality.measure import Measurements, measure_views
from handrail.datasets.reading.check import check_whole
from handrail.datasets.statistics.contrast import Contrast, Value, adjusted

ALL = "all episodes"
_SAME_NUMBER, _SAME_TIME = "the same number of episodes", "the same operator time"


@dataclass(frozen=True)
class EpisodeChoice:
    """One way to choose the episodes that are compared; the title says what is held equal."""

    title: str
    groups: Sequence[Group]  # of which quality was measured
    collected: Sequence[Group]  # failures are counted even where quality is measured without
    collecting: Sequence[Value]  # success and successes an hour of each
    measurements: Measurements
    differences: Sequence[Contrast]  # of every metric, each group against the baseline


@dataclass(frozen=True)
class Comparison:
    """The result of a comparison of datasets."""

    config: CompareConfig
    baseline: str  # label that the others are compared with
    views: Sequence[EpisodeChoice]  # all episodes, as many of each, as much operator time of each
    collecting: Sequence[Contrast]  # success, then successes an hour, of each group against the baseline
    outcomes: Outcomes | None  # of trained policies, if evaluations were given

    @property
    def everything(self) -> EpisodeChoice:
        """The view of all episodes."""
        return self.views[0]

    @property
    def labels(self) -> list[str]:
        """Labels of the groups."""
        return [group.label for group in self.everything.groups]

    @property
    def others(self) -> list[str]:
        """Labels but the baseline."""
        return [label for label in self.labels if label != self.baseline]

    @property
    def unlike(self) -> tuple[str, ...]:
        """The differences for which nothing is ranked: tasks, robots."""
        return unlike(self.everything.collected)

    @property
    def colours(self) -> dict[str, str]:
        """A colour for each group, and each condition of policies that belongs to it."""
        found: dict[str, str] = dict(zip(self.labels, COLOURS, strict=False))
        for label in self.outcomes.conditions if self.outcomes else ():
            found.setdefault(label, found[group_of(label, self.labels)])
        return found

    @property
    def contrasts(self) -> list[Contrast]:
        """All that is compared."""
        policies = self.outcomes.differences if self.outcomes else ()
        metrics = [each for view in self.views for each in view.differences]
        return [*policies, *self.collecting, *metrics]

    @property
    def values(self) -> list[Value]:
        """All measures of all conditions."""
        policies = self.outcomes.values if self.outcomes else ()
        groups = [each for view in self.views for each in view.measurements.values.values()]
        metrics = [value for each in groups for value in each.values()]
        return [*policies, *(each for view in self.views for each in view.collecting), *metrics]


def compare(config: CompareConfig) -> Comparison:
    """Compare as configured."""
    config.check()
    for root in config.datasets:
        check_whole(root, config.verify)
    groups = load_groups(config.datasets, config.by, config.labels, config.columns)
    labels = [group.label for group in groups]
    baseline = baseline_of(labels, config.baseline)
    conditions = _conditions(config, groups)
    pairs = pairs_between(list(conditions), baseline, labels)
    rng = np.random.default_rng(config.seed)
    chosen = {ALL: groups, _SAME_NUMBER: matched_number(groups), _SAME_TIME: matched_time(groups)}
    counted = {title: _counted(title, each, config) for title, each in chosen.items()}
    episodes = {title: {each.label: each.episodes for each in found} for title, found in counted.items()}
    measured = zip(chosen, measure_views(episodes, rng, config.margin), strict=True)
    views = [
        EpisodeChoice(
            title,
            counted[title],
            chosen[title],
            [value for group in chosen[title] for value in collected(group, title)],
            found,
            differences(counted[title], found, baseline, rng),
        )
        for title, found in measured
    ]
    (base,) = [group for group in groups if group.label == baseline]
    others = [group for group in groups if group is not base]
    success = [success_difference(group, base) for group in others]
    collecting = [value for group in groups for value in collected(group, ALL, rng)]
    views[0] = replace(views[0], collecting=collecting)
    ratios = [rate_ratio(group, base, rng) for group in others]
    outcomes = judge_pairs(conditions, pairs, rng) if conditions else None
    return Comparison(config, baseline, views, adjusted([*success, *ratios]), outcomes)


def _counted(title: str, groups: Sequence[Group], config: CompareConfig) -> list[Group]:
    """Return the episodes of which quality is measured."""
    counted = [group.successful() for group in groups] if config.success_only else list(groups)
    for group in counted:
        if not group.episodes:
            raise HandrailError(f"--success_only: {group.label!r} has no successful episode among {title}")
    return matched_number(counted) if title == _SAME_NUMBER else counted


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
