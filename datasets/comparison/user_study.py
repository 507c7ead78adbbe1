"""The folder of a user study: its datasets by task and condition, its forms, and every trial measured."""

import math
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
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply
from handrail.datasets.reading.episode import Episode
from handrail.datasets.reading.load import recorded_episodes
from handrail.datasets.statistics.contrast import SHARE
from handrail.datasets.storage.strict_json import load_json

SCRIPTED = "scripted"  # the name of the operator, as handrail-record writes it
_CHOSEN = (
    "contacts",
    "smallest_distance",
    "mode_switches",
    "input_reversals",
    "idle_raw",
    "input_idle",
    "undos",
    "input_age",
    "round_trip",
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
    """What lies in the folder.

    Attributes:
        demo: Whether the participants are synthetic.
        datasets: Folders, by task and condition (a teleop mode).
        scores: What the forms gave; none before the first was filled in.
    """

    root: Path
    demo: bool
    datasets: dict[tuple[str, str], Path]
    scores: tuple[Score, ...]

    @property
    def source(self) -> str:
        """Where the numbers come from: `PEOPLE` or `DEMO`."""
        return DEMO if self.demo else PEOPLE

    @property
    def conditions(self) -> list[str]:
        """The conditions of all tasks."""
        return list(dict.fromkeys(condition for _, condition in self.datasets))


@dataclass(frozen=True)
class Trial:
    """One episode, or one score of a form.

    Attributes:
        participant: Operator of the episode; "" for a scripted operator.
        scene: Its seed; None where it is not recorded.
        dataset: Folder of its dataset; None for a form.
        episode: Its number there.
        values: By measure; NaN where one does not apply.
    """

    task: str
    condition: str
    participant: str
    values: Mapping[str, float]
    scene: int | None = None
    dataset: Path | None = None
    episode: int = 0


def read_study(root: Path) -> StudyData:
    """Read what a study's folder holds."""
    described = load_json(root / "study.json", "the study.json of a user study")
    demo = described.get("demo", False) if isinstance(described, dict) else None
    if not isinstance(demo, bool):
        raise HandrailError(f"{str(root / 'study.json')!r}: expected demo to be true or false, got {demo!r}")
    infos = sorted(root.glob("data/*/*/meta/info.json"))
    datasets = {(info.parents[2].name, info.parents[1].name): info.parents[1] for info in infos}
    if not datasets:
        raise HandrailError(f"study {str(root)!r}: expected datasets in data/TASK/MODE, found none yet")
    path = root / "exports" / "scores.csv"
    scores, conditions = read_scores(path), sorted({condition for _, condition in datasets})
    for score in scores:
        if score.condition not in conditions:
            expected = ", ".join(conditions)
            raise HandrailError(
                f"{str(path)!r}: unknown condition {score.condition!r}: expected one of {expected}"
            )
    demo |= any(score.source == DEMO for score in scores)
    return StudyData(root, demo, datasets, scores)


def form_trials(study: StudyData, title: str) -> list[Trial]:
    """Return every score of the forms."""
    return [
        Trial(title, each.condition, each.participant, {each.score: each.value})
        for each in study.scores
        if each.value is not None
    ]


def read_trials(study: StudyData, scripted: Sequence[Path], columns: ColumnNames) -> tuple[list[Trial], int]:
    """Return all trials of a study, and of datasets of scripted operators beside it.

    Args:
        study: Its folder.
        scripted: More datasets, whose episodes say their task and mode.
        columns: Which column plays which part.

    Returns:
        The trials, and how many episodes were left out since neither a participant nor a script is named.
    """
    found: dict[str, list[tuple[str, Episode]]] = {}
    left_out = 0
    for (task, condition), root in study.datasets.items():
        for episode in recorded_episodes(root, columns):
            if _participant(episode) or episode.meta.get("operator") == SCRIPTED:
                found.setdefault(task, []).append((condition, episode))
            else:
                left_out += 1
    for root in scripted:
        for episode in recorded_episodes(root, columns):
            task, condition = _scripted(root, episode)
            found.setdefault(task, []).append((condition, episode))
    return [trial for task, episodes in found.items() for trial in _measured(task, episodes)], left_out


def _participant(episode: Episode) -> str:
    return str(episode.meta.get("participant") or "")


def _scripted(root: Path, episode: Episode) -> tuple[str, str]:
    """Return task and mode of an episode of a dataset that is no part of the study."""
    where = f"dataset {str(root)!r}, episode {episode.number}"
    if _participant(episode):
        raise HandrailError(
            f"{where}: expected a scripted operator, got participant {_participant(episode)!r};"
            " a study's own datasets are found in --study"
        )
    task, mode = (str(episode.meta.get(name) or "") for name in ("environment", "mode"))
    if not (task and mode):
        raise HandrailError(f"{where}: expected its task and mode in the metadata, found none")
    return task, mode


def _measured(task: str, episodes: Sequence[tuple[str, Episode]]) -> Iterator[Trial]:
    """Yield the trials of a task, all on one scale where their columns are the same."""
    groups: dict[tuple[str, Path], list[Episode]] = {}
    for condition, episode in episodes:
        groups.setdefault((condition, episode.info.root), []).append(episode)
    labels = {f"{condition} of {root}": members for (condition, root), members in groups.items()}
    values = measure(labels, np.random.default_rng(0), metrics=MEASURES).values
    for (condition, root), (label, members) in zip(groups, labels.items(), strict=True):
        for place, episode in enumerate(members):
            seed = episode.meta.get("seed")
            yield Trial(
                task=task,
                condition=condition,
                participant=_participant(episode),
                values={each.name: float(values[each.name][label].values[place]) for each in MEASURES},
                scene=seed if isinstance(seed, int) else None,
                dataset=root,
                episode=episode.number,
            )


def is_known(value: float) -> bool:
    """Return whether a number is one."""
    return math.isfinite(value)
