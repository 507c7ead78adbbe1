"""Every trial with all its measures: who, which task, which condition, which scene."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.people.folder import PeopleFolder
from handrail.datasets.comparison.people.measures import MEASURES
from handrail.datasets.quality.measure import measure
from handrail.datasets.reading.columns import ColumnNames
from handrail.datasets.reading.episode import Episode
from handrail.datasets.reading.load import recorded_episodes

SCRIPTED = "scripted"  # the name of the operator, as handrail-record writes it
_MARGIN = 0.1  # of a metric that is not used here [m]


@dataclass(frozen=True)
class Trial:
    """One episode.

    Attributes:
        task: what was done.
        condition: in which teleop mode.
        participant: who steered; "" for a scripted operator.
        scene: its seed; None where it is not recorded.
        dataset: folder of its dataset.
        episode: its number there.
        values: of `MEASURES`, by name; NaN where one does not apply.
    """

    task: str
    condition: str
    participant: str
    scene: int | None
    dataset: Path
    episode: int
    values: Mapping[str, float]


def read_trials(study: PeopleFolder, beside: Sequence[Path], columns: ColumnNames) -> tuple[list[Trial], int]:
    """Return all trials of a study, and of datasets of scripted operators beside it.

    Args:
        study: its folder.
        beside: more datasets, whose episodes say their task and mode.
        columns: which column plays which part.

    Returns:
        The trials, and how many episodes were left out since neither a participant nor a script is named.
    """
    found: dict[str, list[tuple[str, Episode]]] = {}
    left_out = 0
    for (task, condition), root in study.datasets.items():
        for episode in recorded_episodes(root, columns):
            named = bool(_participant(episode)) or episode.meta.get("operator") == SCRIPTED
            left_out += not named
            if named:
                found.setdefault(task, []).append((condition, episode))
    for root in beside:
        for episode in recorded_episodes(root, columns):
            task, condition = _beside(root, episode)
            found.setdefault(task, []).append((condition, episode))
    return [trial for task, episodes in found.items() for trial in _measured(task, episodes)], left_out


def _participant(episode: Episode) -> str:
    return str(episode.meta.get("participant") or "")


def _beside(root: Path, episode: Episode) -> tuple[str, str]:
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
    groups: dict[str, list[Episode]] = {}
    for condition, episode in episodes:
        groups.setdefault(f"{condition} of {episode.info.root}", []).append(episode)
    conditions = {f"{condition} of {episode.info.root}": condition for condition, episode in episodes}
    measured = measure(groups, np.random.default_rng(0), _MARGIN, MEASURES).values
    for label, members in groups.items():
        for place, episode in enumerate(members):
            seed = episode.meta.get("seed")
            yield Trial(
                task=task,
                condition=conditions[label],
                participant=_participant(episode),
                scene=seed if isinstance(seed, int) else None,
                dataset=episode.info.root,
                episode=episode.number,
                values={each.name: float(measured[each.name][label].values[place]) for each in MEASURES},
            )
