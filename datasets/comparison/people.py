"""People and scripted operators in one comparison: each task by itself, and the forms.

Participants are what is resampled: a difference is taken within each of them.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from handrail.datasets.comparison import user_study
from handrail.datasets.comparison.config import CompareConfig
from handrail.datasets.comparison.groups import baseline_of
from handrail.datasets.comparison.report import Report, contrast_table, values_table
from handrail.datasets.comparison.scores import SCORES
from handrail.datasets.presentation.markup import paragraph
from handrail.datasets.presentation.table import Table
from handrail.datasets.reading.check import check_whole
from handrail.datasets.statistics.contrast import (
    LEVEL,
    Contrast,
    Estimate,
    Measure,
    Value,
    adjusted,
    contrast,
    mean_value,
)
from handrail.datasets.statistics.resampling import FEWEST, bootstrap_mean, p_of_means

FORMAT = "handrail.people/3"
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


@dataclass(frozen=True)
class PeopleComparison:
    """The result of a comparison of people; the scope of a value or a contrast is a task, or the forms."""

    study: user_study.StudyData
    baseline: str  # condition that the others are compared with
    participants: Sequence[str]  # everyone who has an episode
    trials: Sequence[user_study.Trial]
    values: Sequence[Value]  # of people's conditions, then of scripted operators'
    contrasts: Sequence[Contrast]  # of every measure, each condition against the baseline; people only
    limits: Mapping[str, object]

    def tables(self, scope: str) -> list[Table]:
        """Return the table of means of a task or the forms, and that of the differences if there are any."""
        note = f"{self.study.source}. " if self.study.demo else ""
        values = [each for each in self.values if each.scope == scope]
        contrasts = [each for each in self.contrasts if each.scope == scope]
        means = values_table(values, f"{note}{scope}", _MEANS, note=_count)
        columns = ("measure", "group", "difference", "95 %", "p, Holm", "n")
        title = f"{note}{scope}: against {self.baseline}, paired by participant"
        differences = contrast_table(contrasts, columns, title, _CONTRASTS)
        return [means, differences] if contrasts else [means]


def _count(value: Value) -> str:
    return f"n = {len(value.known)} of {len(value.values)}"


def compare_people(config: CompareConfig) -> PeopleComparison:
    """Compare the conditions of a study as configured."""
    config.check()
    study = user_study.read_study(Path(config.study).expanduser())
    scripted = [Path(root).expanduser() for root in config.datasets]
    for root in (*study.datasets.values(), *scripted):
        check_whole(root, config.verify)
    trials, left_out = user_study.read_trials(study, scripted, config.columns)
    baseline, rng = baseline_of(study.conditions, config.baseline), np.random.default_rng(config.seed)
    participants = tuple(sorted({trial.participant for trial in trials if trial.participant}))
    values: list[Value] = []
    contrasts: list[Contrast] = []
    for task in dict.fromkeys(trial.task for trial in trials):
        chosen = [trial for trial in trials if trial.task == task]
        driven = list(dict.fromkeys(trial.condition for trial in chosen if trial.participant))
        people = dict.fromkeys(trial.participant for trial in chosen if trial.participant)
        found = compared(task, user_study.MEASURES, chosen, driven, baseline, list(people), rng)
        values, contrasts = values + found[0], contrasts + found[1]
    forms = user_study.form_trials(study, FORMS)
    found = compared(FORMS, SCORES, forms, study.conditions, baseline, participants, rng)
    values, contrasts = values + found[0], contrasts + found[1]
    limits = _limits(study, participants, trials, contrasts, left_out)
    return PeopleComparison(study, baseline, participants, trials, values, contrasts, limits)


def compared(
    scope: str,
    measures: Sequence[Measure],
    trials: Sequence[user_study.Trial],
    labels: Sequence[str],
    baseline: str,
    participants: Sequence[str],
    rng: np.random.Generator,
) -> tuple[list[Value], list[Contrast]]:
    """Return every measure under every condition, and each condition against the baseline.

    Args:
        scope: A task, or the forms.
        measures: Which.
        trials: Of the task.
        labels: Of the conditions under which people drove.
        baseline: The condition that the others are compared with.
        participants: All participants.
        rng: Of resampling and permutation.
    """
    apart = rng.spawn(1)[0]  # scripts change nothing of people
    scripted = list(dict.fromkeys(each.condition for each in trials if not each.participant))
    tests = len(measures) * (len(labels) - 1)
    values: list[Value] = []
    contrasts: list[Contrast] = []
    for measure in measures:
        people = {label: _of_people(trials, label, measure.name) for label in labels}
        found = {}
        for label, scenes in people.items():
            means = [_mean(scenes.get(name, {})) for name in dict.fromkeys([*scenes, *participants])]
            found[label] = mean_value(measure, label, np.array(means), rng, scope=scope)
        values += found.values()
        for label in scripted:
            drawn = [t.values[measure.name] for t in trials if (t.condition, t.participant) == (label, "")]
            values.append(mean_value(measure, f"{label}, scripted", np.array(drawn), apart, scope=scope))
        contrasts += [
            contrast(found[label], found[baseline], paired_by_scene(scenes, people[baseline], rng, tests))
            for label, scenes in people.items()
            if label != baseline and baseline in people
        ]
    return values, adjusted(replace(each, family=scope) for each in contrasts)


def _of_people(trials: Sequence[user_study.Trial], label: str, measure: str) -> OfPeople:
    """Return a measure's values under a condition by participant and scene, also for those with none."""
    found: dict[str, dict[int | None, list[float]]] = {}
    for trial in trials:
        if trial.participant and trial.condition == label and measure in trial.values:
            scenes = found.setdefault(trial.participant, {})
            if math.isfinite(trial.values[measure]):
                scenes.setdefault(trial.scene, []).append(trial.values[measure])
    return found


def paired_by_scene(one: OfPeople, other: OfPeople, rng: np.random.Generator, tests: int = 1) -> Estimate:
    """Return how a condition differs from the baseline, paired by participant, and by scene where possible.

    d_p = mean over the scenes that participant p met under both; where they met none twice, the difference of
    their means. The estimate is the mean of d_p; p from swapping the signs of d_p.
    """
    both = [name for name in one if one[name] and other.get(name)]
    differences = np.array([_difference(one[name], other[name]) for name in both])
    enough, zeros, p = len(both) >= FEWEST, np.zeros_like(differences), None
    interval = bootstrap_mean(differences, rng) if enough else None
    if enough and differences.any():
        p = p_of_means((differences, zeros), True, rng, tests)
    estimate = float(differences.mean()) if both else None
    return Estimate(estimate=estimate, interval=interval, p=p, counts=(len(both),), paired=True)


def _mean(scenes: Scenes) -> float:
    known = [value for values in scenes.values() for value in values]
    return float(np.mean(known)) if known else math.nan


def _difference(one: Scenes, other: Scenes) -> float:
    shared = [scene for scene in one if scene is not None and scene in other]
    if not shared:
        return _mean(one) - _mean(other)
    return float(np.mean([np.mean(one[scene]) - np.mean(other[scene]) for scene in shared]))


def _within_reach(contrasts: Sequence[Contrast]) -> bool:
    """Return whether any difference could be detected: if all participants differ alike, p is 2¹⁻ⁿ."""
    tests = max((each.tests for each in contrasts), default=1)  # 1 also of a measure in which nobody differs
    return any(tests * 2.0 ** (1 - each.counts[0]) < LEVEL for each in contrasts if each.interval)


def _limits(
    study: user_study.StudyData,
    participants: Sequence[str],
    trials: Sequence[user_study.Trial],
    contrasts: Sequence[Contrast],
    left_out: int,
) -> dict[str, object]:
    """Return what limits the comparison, and whether it does."""
    count, strangers = len(participants), {each.participant for each in study.scores} - set(participants)
    tasks = dict.fromkeys(trial.task for trial in trials)
    scopes = [[each for each in contrasts if each.scope == scope] for scope in (*tasks, FORMS)]
    reach = all(_within_reach(found) for found in scopes if any(each.counts[0] for each in found))
    return {
        f"Participants: {count}. Intervals and tests need {FEWEST} or more, so there are none.": count
        < FEWEST,
        f"Participants: {count}. Too few to detect any difference in some tables.": count >= FEWEST
        and not reach,
        f"Participants: {count}. Below 20, intervals are rough: of 5, some 84 % hold.": FEWEST <= count < 20,
        _SCRIPTED: any(not trial.participant for trial in trials),
        _ALONE: not all(scopes[:-1]),
        "No scores yet: exports/scores.csv is not there.": not study.scores,
        f"Participants with scores and without an episode: {len(strangers)}.": strangers,
        f"Episodes that name neither a participant nor a script, left out: {left_out}.": left_out,
    }


def people_report(comparison: PeopleComparison) -> Report:
    """Return the report of a comparison of people."""
    study, baseline, people = comparison.study, comparison.baseline, comparison.participants
    scopes = dict.fromkeys(each.scope for each in comparison.values)
    tables = [table for scope in scopes for table in comparison.tables(scope)]
    content = {"format": FORMAT, "demo": study.demo, "baseline": baseline, "participants": people}
    return Report(
        title=f"{study.root.absolute().name}: people, compared",
        what=f"{len(people)} participants; baseline {baseline}",
        first=[paragraph(study.source, "headline")] if study.demo else (),
        limits=comparison.limits,
        tables=tables,
        sections=[("", [table]) for table in tables],
        how=_HOW,
        content=content,
        values=comparison.values,
        contrasts=comparison.contrasts,
        units={"trials.csv": [_row(trial) for trial in comparison.trials]},
        source={"source": study.source},
    )


def _row(each: user_study.Trial) -> dict[str, Any]:
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
