"""People and scripted operators in one comparison: each task by itself, and the forms.

Participants are what is resampled: a difference is taken within each of them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import unknown_name
from handrail.datasets.comparison.config import CompareConfig
from handrail.datasets.comparison.report import (
    contrast_table,
    measure_cell,
    shown,
    shown_interval,
)
from handrail.datasets.comparison.scores import SCORES
from handrail.datasets.comparison.user_study import (
    MEASURES,
    StudyData,
    Trial,
    form_trials,
    is_known,
    read_study,
    read_trials,
)
from handrail.datasets.presentation.table import Cell, Table
from handrail.datasets.reading.check import check_whole
from handrail.datasets.statistics.contrast import LEVEL, Contrast, Estimate, Measure, adjusted
from handrail.datasets.statistics.resampling import (
    FEWEST,
    bootstrap_mean,
    difference_of_means,
    permutation_p,
)

FORMS = "workload and usability"
_TOO_FEW = f"Participants: {{}}. Intervals and tests need {FEWEST} or more, so there are none."
_BLIND = "Participants: {}. Too few to detect any difference in some tables; the intervals describe it."
_SCRIPTED = (
    "Scripted operators stand beside the people, over their own episodes: they are not paired with them, and"
    " nothing is tested between the two."
)
_ALONE = "In some tasks people drove no other condition beside the baseline: there is nothing to compare."
_NO_SCORES = "No scores yet: exports/scores.csv is not there."
_STRANGERS = "Participants with scores and without an episode: {}."
_LEFT_OUT = "Episodes that name neither a participant nor a script, and are left out: {}."
_MEANS = "Means over participants; 95 % below, by resampling participants; n: who has a value, of all."
_CONTRASTS = "Differences within participants; p after Holm over this table; bold: detected."

Scenes = Mapping[int | None, Sequence[float]]  # values by scene
OfPeople = Mapping[str, Scenes]  # by participant


@dataclass(frozen=True, kw_only=True)
class Mean(Estimate):
    """A measure under one condition.

    Attributes:
        scripted: Whether scripted operators steered; then an episode counts as a participant does.
        total: Participants (or scripted episodes) there are; `counts` has those with a value.
    """

    label: str
    scripted: bool
    total: int

    @property
    def content(self) -> dict[str, Any]:
        """What the JSON has."""
        named = {"label": self.label, "scripted": self.scripted, "count": self.counts[0], "total": self.total}
        return named | {"mean": self.estimate, "interval": self.interval}


@dataclass(frozen=True)
class PeoplePart:
    """A task, or the forms.

    Attributes:
        measures: What was measured.
        means: Of each measure, by its name: people's conditions first, then scripted operators'.
        contrasts: Of every measure, each condition against the baseline; people only.
    """

    title: str
    measures: Sequence[Measure]
    means: dict[str, list[Mean]]
    contrasts: list[Contrast]


@dataclass(frozen=True)
class PeopleComparison:
    """What was found.

    Attributes:
        baseline: The condition that the others are compared with.
        participants: Everyone who has an episode.
        trials: Every episode.
        parts: A task each, and the forms last.
        cautions: What a reader has to know.
    """

    config: CompareConfig
    study: StudyData
    baseline: str
    participants: Sequence[str]
    trials: Sequence[Trial]
    parts: Sequence[PeoplePart]
    cautions: Sequence[str]

    @property
    def tables(self) -> list[Table]:
        """The tables of every part: means, then differences."""
        note = f"{self.study.source}. " if self.study.demo else ""
        found = []
        for part in self.parts:
            found.append(_means_table(part, note))
            if part.contrasts:
                title = f"{note}{part.title}: against {self.baseline}, paired by participant"
                columns = ("measure", "group", "difference", "95 %", "p, Holm", "n")
                found.append(contrast_table(part.contrasts, columns, title, _CONTRASTS))
        return found


def compare_people(config: CompareConfig) -> PeopleComparison:
    """Compare the conditions of a study as configured."""
    config.check()
    study = read_study(Path(config.study).expanduser())
    scripted = [Path(root).expanduser() for root in config.datasets]
    for root in (*study.datasets.values(), *scripted):
        check_whole(root, config.verify)
    trials, left_out = read_trials(study, scripted, config.columns)
    if config.baseline and config.baseline not in study.conditions:
        raise unknown_name("baseline", config.baseline, study.conditions)
    baseline, rng = config.baseline or study.conditions[0], np.random.default_rng(config.seed)
    participants = tuple(sorted({trial.participant for trial in trials if trial.participant}))
    parts = []
    for task in dict.fromkeys(trial.task for trial in trials):
        chosen = [trial for trial in trials if trial.task == task]
        driven = list(dict.fromkeys(trial.condition for trial in chosen if trial.participant))
        total = len({trial.participant for trial in chosen if trial.participant})
        parts.append(compared(task, MEASURES, chosen, driven, baseline, total, rng))
    forms = form_trials(study, FORMS)
    parts.append(compared(FORMS, SCORES, forms, study.conditions, baseline, len(participants), rng))
    cautions = _cautions(study, participants, parts, left_out)
    return PeopleComparison(config, study, baseline, participants, trials, parts, cautions)


def compared(
    title: str,
    measures: Sequence[Measure],
    trials: Sequence[Trial],
    labels: Sequence[str],
    baseline: str,
    total: int,
    rng: np.random.Generator,
) -> PeoplePart:
    """Return the means of every measure under every condition, and each condition against the baseline.

    Args:
        title: Of the part: a task, or the forms.
        measures: What was measured.
        trials: Of the part.
        labels: Of the conditions under which people drove.
        baseline: The condition that the others are compared with.
        total: Participants there are.
        rng: Of resampling and permutation.
    """
    scripted = list(dict.fromkeys(each.condition for each in trials if not each.participant))
    means: dict[str, list[Mean]] = {}
    contrasts: list[Contrast] = []
    for measure in measures:
        people = {label: of_people(trials, label, measure.name) for label in labels}
        found = []
        for label, values in people.items():
            each = np.array([_mean(scenes) for scenes in values.values() if scenes])
            found.append(Mean(label=label, scripted=False, total=total, **vars(mean_of(each, rng))))
        for label in scripted:
            all_of = [t.values[measure.name] for t in trials if (t.condition, t.participant) == (label, "")]
            known = np.array([value for value in all_of if is_known(value)])
            found.append(Mean(label=label, scripted=True, total=len(all_of), **vars(mean_of(known, rng))))
        means[measure.name] = found
        contrasts += [
            contrast(measure, label, baseline, people[label], people[baseline], rng)
            for label in labels
            if label != baseline and baseline in people
        ]
    return PeoplePart(
        title, measures, means, adjusted(replace(e, scope=title, family=title) for e in contrasts)
    )


def of_people(trials: Sequence[Trial], label: str, measure: str) -> OfPeople:
    """Return a measure's values under a condition by participant and scene, also for those with none."""
    found: dict[str, dict[int | None, list[float]]] = {}
    for trial in trials:
        if trial.participant and trial.condition == label and measure in trial.values:
            scenes = found.setdefault(trial.participant, {})
            if is_known(trial.values[measure]):
                scenes.setdefault(trial.scene, []).append(trial.values[measure])
    return found


def mean_of(values: FloatArray, rng: np.random.Generator) -> Estimate:
    """Return the mean over units, each of which counts alike; its interval for five or more."""
    if not len(values):
        return Estimate(counts=(0,))
    interval = bootstrap_mean(values, rng) if len(values) >= FEWEST else None
    return Estimate(estimate=float(values.mean()), interval=interval, counts=(len(values),))


def contrast(
    measure: Measure, label: str, baseline: str, one: OfPeople, other: OfPeople, rng: np.random.Generator
) -> Contrast:
    """Return how a condition differs from the baseline, paired by participant, and by scene where possible.

    d_p = mean over the scenes that participant p met under both; where they met none twice, the difference of
    their means. The estimate is the mean of d_p; p from swapping the signs of d_p.
    """
    both = [name for name in one if one[name] and other.get(name)]
    differences = np.array([_difference(one[name], other[name]) for name in both])
    p, found = None, mean_of(differences, rng)
    if len(both) >= FEWEST and differences.any():
        p = permutation_p((differences, np.zeros_like(differences)), difference_of_means, True, rng)
    names = {"measure": measure, "label": label, "baseline": baseline, "paired": True, "p": p}
    return Contrast(**vars(found) | names)


def _mean(scenes: Scenes) -> float:
    return float(np.mean([value for values in scenes.values() for value in values]))


def _difference(one: Scenes, other: Scenes) -> float:
    shared = [scene for scene in one if scene is not None and scene in other]
    if not shared:
        return _mean(one) - _mean(other)
    return float(np.mean([np.mean(one[scene]) - np.mean(other[scene]) for scene in shared]))


def _within_reach(contrasts: Sequence[Contrast]) -> bool:
    """Return whether any difference could be detected: if all participants differ alike, p is 2¹⁻ⁿ."""
    return any(each.tests * 2.0 ** (1 - each.counts[0]) < LEVEL for each in contrasts if each.p is not None)


def _cautions(
    study: StudyData, participants: Sequence[str], parts: Sequence[PeoplePart], left_out: int
) -> list[str]:
    count, strangers = len(participants), {each.participant for each in study.scores} - set(participants)
    means = [mean for part in parts for means in part.means.values() for mean in means]
    known = {
        _TOO_FEW.format(count): count < FEWEST,
        _BLIND.format(count): count >= FEWEST and not all(_within_reach(part.contrasts) for part in parts),
        _SCRIPTED: any(mean.scripted for mean in means),
        _ALONE: any(not part.contrasts and part.title != FORMS for part in parts),
        _NO_SCORES: not study.scores,
        _STRANGERS.format(len(strangers)): bool(strangers),
        _LEFT_OUT.format(left_out): left_out > 0,
    }
    return [text for text, holds in known.items() if holds]


def _means_table(part: PeoplePart, note: str) -> Table:
    """Return every measure under every condition."""
    (first, *_) = part.means.values()
    labels = [f"{mean.label}, scripted" if mean.scripted else mean.label for mean in first]
    rows = [
        [measure_cell(each), *(_mean_cell(mean, each) for mean in part.means[each.name])]
        for each in part.measures
    ]
    return Table(("", *labels), rows, f"{note}{part.title}", _MEANS)


def _mean_cell(mean: Mean, measure: Measure) -> Cell:
    below = f"n = {mean.counts[0]} of {mean.total}"
    if mean.estimate is None:
        return Cell("missing", "quiet", below=below)
    span = f"{shown_interval(measure, mean.interval)}; " if mean.interval else ""
    return Cell(shown(measure, mean.estimate), below=span + below)
