"""The folder of a user study: its datasets by task and condition, its forms, and every trial measured."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.scores import DEMO, PEOPLE, Score, read_scores
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.quality.measure import measure
from handrail.datasets.quality.metric import metric
from handrail.datasets.quality.scale import Scale
from handrail.datasets.reading.columns import ColumnNames
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply, Episode
from handrail.datasets.reading.load import recorded_episodes
from handrail.datasets.statistics.contrast import SHARE
from handrail.datasets.storage.strict_json import load_json

SCRIPTED = "scripted"  # the name of the operator, as handrail-record writes it
_CHOSEN = (
    *("contacts", "smallest_distance", "mode_switches", "input_reversals", "idle_raw", "input_idle"),
    *("undos", "input_age", "round_trip"),
)


@metric(SHARE, "higher")
def success(episode: Demonstration, scale: Scale) -> float:
    """Share of the episodes that succeeded."""
    if episode.success is None:
        raise DoesNotApply("success was not recorded")
    return float(episode.success)


@metric("s", "lower")
def completion_time(episode: Demonstration, scale: Scale) -> float:
    """How long the episodes that succeeded took."""
    if not episode.success:
        raise DoesNotApply("it did not succeed")
    return episode.seconds


MEASURES = (success, completion_time, *(each for each in METRICS if each.name in _CHOSEN))


@dataclass(frozen=True)
class StudyData:
    """The content of a study's folder."""

    root: Path
    demo: bool  # whether the participants are synthetic
    datasets: Mapping[tuple[str, str], Path]  # by task and condition (a teleop mode)
    scores: tuple[Score, ...]  # of the forms

    @property
    def source(self) -> str:
        """The source of the numbers: `PEOPLE` or `DEMO`."""
        return DEMO if self.demo else PEOPLE

    @property
    def conditions(self) -> list[str]:
        """The conditions of all tasks."""
        return list(dict.fromkeys(condition for _, condition in self.datasets))


@dataclass(frozen=True)
class Trial:
    """One episode, or one score of a form."""

    task: str
    condition: str
    participant: str  # "" for a scripted operator
    values: Mapping[str, float]  # by measure; NaN where one does not apply
    scene: int | None = None  # seed of the episode
    dataset: Path | None = None  # None for a form
    episode: int = 0


def read_study(root: Path) -> StudyData:
    """Read a study's folder."""
    described = load_json(root / "study.json", "the study.json of a user study")
    demo = described.get("demo", False) if isinstance(described, dict) else None
    if not isinstance(demo, bool):
        raise HandrailError(f"{str(root / 'study.json')!r}: expected demo to be true or false, got {demo!r}")
    infos = sorted(root.glob("data/[!.]*/[!.]*/meta/info.json"))
    datasets = {(info.parents[2].name, info.parents[1].name): info.parents[1] for info in infos}
    if not datasets:
        raise HandrailError(f"study {str(root)!r}: expected datasets in data/TASK/MODE, found none yet")
    path = root / "exports" / "scores.csv"
    scores, conditions = read_scores(path), sorted({condition for _, condition in datasets})
    for name in (score.condition for score in scores if score.condition not in conditions):
        expected = ", ".join(conditions)
        raise HandrailError(f"{str(path)!r}: unknown condition {name!r}: expected one of {expected}")
    return StudyData(root, demo or any(score.source == DEMO for score in scores), datasets, scores)


def form_trials(study: StudyData, title: str) -> list[Trial]:
    """Return every score of the forms."""
    known = [each for each in study.scores if each.value is not None]
    return [Trial(title, e.condition, e.participant, {e.score: float(e.value or 0.0)}) for e in known]


def read_trials(study: StudyData, scripted: Sequence[Path], columns: ColumnNames) -> tuple[list[Trial], int]:
    """Return all trials of a study, and of datasets of scripted operators beside it.

    Args:
        study: Its folder.
        scripted: More datasets, whose episodes say their task and mode.
        columns: Which column plays which part.

    Returns:
        The trials, and how many episodes were left out since neither a participant nor a script is named.
    """
    found: dict[tuple[str, bool], list[tuple[str, Episode]]] = {}  # people have a scale of their own
    left_out = 0
    for (task, condition), root in study.datasets.items():
        for episode in recorded_episodes(root, columns):
            if _participant(episode) or episode.meta.get("operator") == SCRIPTED:
                found.setdefault((task, bool(_participant(episode))), []).append((condition, episode))
            else:
                left_out += 1
    for episode in (episode for root in scripted for episode in recorded_episodes(root, columns)):
        task, condition = _task_and_mode(episode)
        found.setdefault((task, False), []).append((condition, episode))
    return [trial for (task, _), episodes in found.items() for trial in _measured(task, episodes)], left_out


def _participant(episode: Episode) -> str:
    return str(episode.meta.get("participant") or "")


def _task_and_mode(episode: Episode) -> tuple[str, str]:
    """Return task and mode of an episode of a dataset that is no part of the study."""
    where = f"dataset {str(episode.info.root)!r}, episode {episode.number}"
    name, operator = _participant(episode), episode.meta.get("operator")
    if name or operator != SCRIPTED:
        got = f"participant {name!r}" if name else repr(operator)
        raise HandrailError(
            f"{where}: expected a scripted operator, got {got}; a study's own datasets are found in --study"
        )
    task, mode = (str(episode.meta.get(name) or "") for name in ("environment", "mode"))
    if not (task and mode):
        raise HandrailError(f"{where}: expected its task and mode in the metadata, found none")
    return task, mode


def _measured(task: str, episodes: Sequence[tuple[str, Episode]]) -> Iterator[Trial]:
    """Yield the trials of a task, all on one scale where their columns are the same."""
    groups: dict[str, list[tuple[str, Episode]]] = {}
    for condition, episode in episodes:
        groups.setdefault(f"{condition} of {episode.info.root}", []).append((condition, episode))
    sets = {label: [episode for _, episode in members] for label, members in groups.items()}
    values = measure(sets, np.random.default_rng(0), metrics=MEASURES).values
    for label, members in groups.items():
        for place, (condition, episode) in enumerate(members):
            seed = episode.meta.get("seed")
            yield Trial(
                task=task,
                condition=condition,
                participant=_participant(episode),
                values={each.name: float(values[each.name][label].values[place]) for each in MEASURES},
                scene=seed if isinstance(seed, int) else None,
                dataset=episode.info.root,
                episode=episode.number,
            )
