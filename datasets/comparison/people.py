"""People and scripted operators in one comparison: each task by itself, and the forms.

Participants are what is resampled: a difference is taken within each of them.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import unknown_name
from handrail.datasets.comparison.config import CompareConfig
from handrail.datasets.comparison.report import Report, contrast_table, measure_cell, shown
from handrail.datasets.comparison.scores import SCORES
from handrail.datasets.comparison.user_study import (
    MEASURES,
    StudyData,
    Trial,
    form_trials,
    read_study,
    read_trials,
)
from handrail.datasets.presentation.markup import paragraph
from handrail.datasets.presentation.table import Table
from handrail.datasets.reading.check import check_whole
from handrail.datasets.statistics.contrast import LEVEL, Contrast, Estimate, Measure, adjusted
from handrail.datasets.statistics.resampling import FEWEST, bootstrap_mean, difference_of_means, permutation_p

FORMAT = "handrail.people/2"
FORMS = "workload and usability"
_MEANS = "Means over participants; 95 % below, by resampling participants; n: who has a value, of all."
_CONTRASTS = "Differences within participants; p after Holm over this table; bold: detected."
_SCRIPTED = (
    "Scripted operators stand beside the people, over their own episodes: they are not paired with them, and"
    " nothing is tested between the two."
)
_ALONE = "In some tasks people drove no other condition beside the baseline: there is nothing to compare."
_HOW = (
    "A participant's value is the mean over their episodes of a task in a condition. A difference is taken"
    " within each participant, over the scenes that they met under both conditions, else of their means; then"
    " the mean over participants. Intervals are 95 %, by a bootstrap that resamples participants. p:"
    " permutation of the signs of the participants' differences, exact where there are few, adjusted by Holm"
    " over each table. A difference is detected if its interval leaves zero out and p stays below 0.05."
)

Scenes = Mapping[int | None, Sequence[float]]  # values by scene
OfPeople = Mapping[str, Scenes]  # by participant


@dataclass(frozen=True, kw_only=True)
class Mean(Estimate):
    """A measure under one condition; of scripted operators an episode counts as a participant does."""

    label: str
    scripted: bool
    total: int  # participants (or scripted episodes) there are; `counts` has those with a value

    @property
    def content(self) -> dict[str, Any]:
        """Its entry in the JSON."""
        named = {"label": self.label, "scripted": self.scripted, "count": self.counts[0], "total": self.total}
        return named | {"mean": self.estimate, "interval": self.interval}


@dataclass(frozen=True)
class PeoplePart:
    """A task, or the forms."""

    title: str
    measures: Sequence[Measure]
    means: dict[str, list[Mean]]  # by measure: people's conditions first, then scripted operators'
    contrasts: list[Contrast]  # of every measure, each condition against the baseline; people only

    def tables(self, baseline: str, note: str) -> list[Table]:
        """Return the table of means, and that of the differences if there are any."""
        (first, *_) = self.means.values()
        labels = [f"{mean.label}, scripted" if mean.scripted else mean.label for mean in first]
        rows = [
            [measure_cell(each), *(_cell(mean, each) for mean in self.means[each.name])]
            for each in self.measures
        ]
        columns = ("measure", "group", "difference", "95 %", "p, Holm", "n")
        title = f"{note}{self.title}: against {baseline}, paired by participant"
        differences = contrast_table(self.contrasts, columns, title, _CONTRASTS)
        means = Table(("", *labels), rows, f"{note}{self.title}", _MEANS)
        return [means, differences] if self.contrasts else [means]


def _cell(mean: Mean, measure: Measure) -> Any:
    return shown(measure, mean.estimate, mean.interval, f"n = {mean.counts[0]} of {mean.total}")


@dataclass(frozen=True)
class PeopleComparison:
    """The result of a comparison of people."""

    config: CompareConfig
    study: StudyData
    baseline: str  # condition that the others are compared with
    participants: Sequence[str]  # everyone who has an episode
    trials: Sequence[Trial]
    parts: Sequence[PeoplePart]  # a task each, and the forms last
    cautions: Sequence[str]


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
        measures: Which.
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
        people = {label: _of_people(trials, label, measure.name) for label in labels}
        found = means[measure.name] = []
        for label, values in people.items():
            each = np.array([_mean(scenes) for scenes in values.values() if scenes])
            found.append(Mean(label=label, scripted=False, total=total, **vars(_mean_of(each, rng))))
        for label in scripted:
            drawn = [t.values[measure.name] for t in trials if (t.condition, t.participant) == (label, "")]
            known = np.array([value for value in drawn if math.isfinite(value)])
            found.append(Mean(label=label, scripted=True, total=len(drawn), **vars(_mean_of(known, rng))))
        contrasts += [
            contrast(measure, label, baseline, people[label], people[baseline], rng)
            for label in labels
            if label != baseline and baseline in people
        ]
    tested = adjusted(replace(each, scope=title, family=title) for each in contrasts)
    return PeoplePart(title, measures, means, tested)


def _of_people(trials: Sequence[Trial], label: str, measure: str) -> OfPeople:
    """Return a measure's values under a condition by participant and scene, also for those with none."""
    found: dict[str, dict[int | None, list[float]]] = {}
    for trial in trials:
        if trial.participant and trial.condition == label and measure in trial.values:
            scenes = found.setdefault(trial.participant, {})
            if math.isfinite(trial.values[measure]):
                scenes.setdefault(trial.scene, []).append(trial.values[measure])
    return found


def _mean_of(values: FloatArray, rng: np.random.Generator) -> Estimate:
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
    p, found = None, _mean_of(differences, rng)
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
    reach = count < FEWEST or all(_within_reach(part.contrasts) for part in parts)
    known = [
        (
            count < FEWEST,
            f"Participants: {count}. Intervals and tests need {FEWEST} or more, so there are none.",
        ),
        (not reach, f"Participants: {count}. Too few to detect any difference in some tables."),
        (any(mean.scripted for mean in means), _SCRIPTED),
        (any(not part.contrasts and part.title != FORMS for part in parts), _ALONE),
        (not study.scores, "No scores yet: exports/scores.csv is not there."),
        (bool(strangers), f"Participants with scores and without an episode: {len(strangers)}."),
        (left_out > 0, f"Episodes that name neither a participant nor a script, left out: {left_out}."),
    ]
    return [text for holds, text in known if holds]


def people_report(comparison: PeopleComparison) -> Report:
    """Return the report of a comparison of people."""
    study, parts, baseline = comparison.study, comparison.parts, comparison.baseline
    source, note = {"source": study.source}, f"{study.source}. " if study.demo else ""
    tables = [table for part in parts for table in part.tables(baseline, note)]
    content = {
        "format": FORMAT,
        "demo": study.demo,
        "baseline": baseline,
        "participants": comparison.participants,
        "cautions": comparison.cautions,
        "conditions": {
            part.title: {name: [mean.content for mean in means] for name, means in part.means.items()}
            for part in parts
        },
    }
    return Report(
        title=f"{study.root.absolute().name}: people, compared",
        what=f"{len(comparison.participants)} participants; baseline {baseline}",
        first=[paragraph(study.source, "headline")] if study.demo else (),
        cautions=comparison.cautions,
        tables=tables,
        sections=[("", [table]) for table in tables],
        how=_HOW,
        measures=list(dict.fromkeys(measure for part in parts for measure in part.measures)),
        content=source | content,
        contrasts=[each for part in parts for each in part.contrasts],
        units={"trials.csv": [source | _row(trial) for trial in comparison.trials]},
        source=source,
    )


def _row(each: Trial) -> dict[str, Any]:
    return {
        "task": each.task,
        "condition": each.condition,
        "participant": each.participant,
        "operator": "person" if each.participant else "scripted",
        "scene": each.scene,
        "dataset": each.dataset.name if each.dataset else "",
        "episode": each.episode,
        **each.values,
    }
