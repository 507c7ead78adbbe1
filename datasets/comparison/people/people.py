"""People and scripted operators in one comparison: each task by itself, and the forms."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from handrail.controllers.errors import unknown_name
from handrail.datasets.comparison.config import CompareConfig
from handrail.datasets.comparison.people.contrasts import (
    Contrast,
    Mean,
    OfPeople,
    adjusted,
    contrast,
    mean_of_people,
    mean_of_scripts,
    of_people,
    within_reach,
)
from handrail.datasets.comparison.people.folder import PeopleFolder, read_study
from handrail.datasets.comparison.people.measures import MEASURES
from handrail.datasets.comparison.people.scores import SCORES, Score
from handrail.datasets.comparison.people.trials import Trial, read_trials
from handrail.datasets.quality.metric import Metric
from handrail.datasets.reading.check import check_whole
from handrail.datasets.statistics.resampling import FEWEST

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


@dataclass(frozen=True)
class PeoplePart:
    """A task, or the forms.

    Attributes:
        title: its name.
        measures: what was measured.
        means: of each measure, by its name: people's conditions first, then scripted operators'.
        contrasts: of every measure, each condition against the baseline; people only.
    """

    title: str
    measures: tuple[Metric, ...]
    means: dict[str, tuple[Mean, ...]]
    contrasts: tuple[Contrast, ...]


@dataclass(frozen=True)
class PeopleComparison:
    """What was found.

    Attributes:
        config: what was asked.
        study: what lies in its folder.
        baseline: the condition that the others are compared with.
        participants: everyone who has an episode.
        trials: every episode.
        parts: a task each, and the forms last.
        cautions: what a reader has to know.
    """

    config: CompareConfig
    study: PeopleFolder
    baseline: str
    participants: tuple[str, ...]
    trials: tuple[Trial, ...]
    parts: tuple[PeoplePart, ...]
    cautions: tuple[str, ...]


def compare_people(config: CompareConfig) -> PeopleComparison:
    """Compare the conditions of a study as configured."""
    config.check()
    study = read_study(Path(config.study).expanduser())
    beside = [Path(root).expanduser() for root in config.datasets]
    for root in (*study.datasets.values(), *beside):
        check_whole(root, config.verify)
    trials, left_out = read_trials(study, beside, config.columns)
    conditions = list(dict.fromkeys(condition for _, condition in study.datasets))
    if config.baseline and config.baseline not in conditions:
        raise unknown_name("baseline", config.baseline, conditions)
    baseline, rng = config.baseline or conditions[0], np.random.default_rng(config.seed)
    participants = tuple(sorted({trial.participant for trial in trials if trial.participant}))
    tasks = dict.fromkeys(trial.task for trial in trials)
    parts = [_task(task, [each for each in trials if each.task == task], baseline, rng) for task in tasks]
    parts.append(_forms(study.scores, conditions, baseline, participants, rng))
    return PeopleComparison(
        config=config,
        study=study,
        baseline=baseline,
        participants=participants,
        trials=tuple(trials),
        parts=tuple(parts),
        cautions=_cautions(study.scores, participants, parts, left_out),
    )


def _task(task: str, trials: Sequence[Trial], baseline: str, rng: np.random.Generator) -> PeoplePart:
    conditions = list(dict.fromkeys(each.condition for each in trials if each.participant))
    scripted = list(dict.fromkeys(each.condition for each in trials if not each.participant))
    total = len({each.participant for each in trials if each.participant})
    means: dict[str, tuple[Mean, ...]] = {}
    contrasts: list[Contrast] = []
    for measure in MEASURES:
        people = {
            label: of_people([each for each in trials if each.condition == label], measure.name)
            for label in conditions
        }
        scripts = {
            label: [
                each.values[measure.name]
                for each in trials
                if each.condition == label and not each.participant
            ]
            for label in scripted
        }
        means[measure.name] = (
            *(mean_of_people(label, values, total, rng) for label, values in people.items()),
            *(mean_of_scripts(label, values, rng) for label, values in scripts.items()),
        )
        contrasts += [
            contrast(measure, label, baseline, people[label], people[baseline], rng)
            for label in conditions
            if label != baseline and baseline in people
        ]
    return PeoplePart(task, MEASURES, means, tuple(adjusted(contrasts)))


def _forms(
    scores: Sequence[Score],
    conditions: Sequence[str],
    baseline: str,
    participants: Sequence[str],
    rng: np.random.Generator,
) -> PeoplePart:
    means: dict[str, tuple[Mean, ...]] = {}
    contrasts: list[Contrast] = []
    for measure in SCORES:
        people: dict[str, OfPeople] = {
            label: {
                each.participant: {None: [each.value]}
                for each in scores
                if (each.condition, each.score) == (label, measure.name) and each.value is not None
            }
            for label in conditions
        }
        means[measure.name] = tuple(
            mean_of_people(label, values, len(participants), rng) for label, values in people.items()
        )
        contrasts += [
            contrast(measure, label, baseline, people[label], people[baseline], rng)
            for label in conditions
            if label != baseline
        ]
    return PeoplePart(FORMS, SCORES, means, tuple(adjusted(contrasts)))


def _cautions(
    scores: Sequence[Score], participants: Sequence[str], parts: Sequence[PeoplePart], left_out: int
) -> tuple[str, ...]:
    count, strangers = len(participants), {each.participant for each in scores} - set(participants)
    means = [mean for part in parts for means in part.means.values() for mean in means]
    known = {
        _TOO_FEW.format(count): count < FEWEST,
        _BLIND.format(count): count >= FEWEST and not all(within_reach(part.contrasts) for part in parts),
        _SCRIPTED: any(mean.scripted for mean in means),
        _ALONE: any(not part.contrasts and part.title != FORMS for part in parts),
        _NO_SCORES: not scores,
        _STRANGERS.format(len(strangers)): bool(strangers),
        _LEFT_OUT.format(left_out): left_out > 0,
    }
    return tuple(text for text, holds in known.items() if holds)
