"""A dataset's card: `README.md`, as LeRobot lays it out, with what was recorded in it."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from handrail.controllers.errors import HandrailError
from handrail.controllers.regular_file import regular
from handrail.datasets.demonstrations.episode import Episode
from handrail.datasets.demonstrations.load import recorded_episodes
from handrail.datasets.presentation.markdown import markdown_table, markdown_text
from handrail.datasets.presentation.table import Table
from handrail.datasets.presentation.wording import DASH, number, percent
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.quality.measure import measure
from handrail.datasets.storage.atomic import explained, write_whole

CARD = "README.md"
TAGS = ("handrail", "teleoperation")
_MARK = "<!-- written by handrail-push -->"
_COUNTED = ("environment", "robot", "operator", "mode", "task")
_NOTES = (
    "The operator steered a part of the motion (`teleop.mode`, `teleop.mask`); a controller completed the"
    " rest. `action` is what was sent to the robot. Handrail's `docs/recording.md` explains every column."
)


def description(root: Path) -> str:
    """Return what was recorded, as Markdown: counts, modes, operators, success and metrics.

    Raises:
        HandrailError: There is no dataset, or a file of it cannot be read.
    """
    episodes = recorded_episodes(root)
    if not episodes:
        raise HandrailError(f"dataset {str(root)!r}: expected an episode or more, found none")
    info = episodes[0].info
    frames = sum(episode.count for episode in episodes)
    lines = (
        f"{len(episodes)} episodes, {frames} frames at {info.fps} Hz, {frames / info.fps / 60:.1f} minutes",
        f"robot {markdown_text(info.robot_type) or DASH}",
        *(f"{name}: {said}" for name in _COUNTED if (said := _counted(episodes, name))),
        *_outcome(episodes),
    )
    listed = "\n".join(f"- {line}" for line in lines)
    table = markdown_table(Table(("metric", "mean", "unit", "meaning"), _metrics(episodes)))
    return f"{_MARK}\n\n{listed}\n\n{_NOTES if info.from_handrail else ''}\n\n{table}"


def write_card(root: Path, repo_id: str, license_id: str) -> str:
    """Write the card with LeRobot's template and return the description in it.

    Raises:
        HandrailError: There is a card that somebody else wrote, no dataset, or the disk does not take it.
    """
    path = root / CARD
    if path.exists() and _MARK not in regular(path).read_text(encoding="utf-8", errors="replace"):
        raise HandrailError(
            f"{str(path)!r}: expected none, or one that handrail-push wrote; found another, which LeRobot's"
            " upload would replace: give it another name"
        )
    from lerobot.datasets.io_utils import load_info
    from lerobot.datasets.utils import create_lerobot_dataset_card

    said = description(root)
    try:
        info = load_info(root)
    except (AttributeError, TypeError, ValueError) as error:
        raise HandrailError(f"dataset {str(root)!r}: LeRobot cannot read meta/info.json: {error}") from error
    card = create_lerobot_dataset_card(
        tags=list(TAGS),
        dataset_info=info,
        license=license_id,
        repo_id=repo_id,
        dataset_description=said,
    )
    with explained(f"cannot write {str(path)!r}"):
        write_whole(path, str(card).encode())
    return said


def _counted(episodes: Sequence[Episode], name: str) -> str:
    """Return the values of a column of metadata and how many episodes have each."""
    values = Counter(value for episode in episodes for value in _values(episode, name))
    return ", ".join(f"{markdown_text(str(value))} ({count})" for value, count in values.most_common())


def _values(episode: Episode, name: str) -> Sequence[Any]:
    if name == "task":
        return episode.meta["tasks"]
    value = episode.meta.get(name)
    return [value] if value else []


def _outcome(episodes: Sequence[Episode]) -> list[str]:
    known = [episode.success for episode in episodes if episode.success is not None]
    reasons = _counted([episode for episode in episodes if episode.success is False], "failure_reason")
    lines = [f"success: {sum(known)} of {len(known)} ({percent(sum(known) / len(known))})"] if known else []
    return lines + ([f"failures: {reasons}"] if reasons else [])


def _metrics(episodes: Sequence[Episode]) -> list[list[str]]:
    """Return a row for each metric of single episodes that applies."""
    metrics = [metric for metric in METRICS if not metric.of_group]
    values = measure({"": episodes}, np.random.default_rng(0), metrics=metrics).values
    return [
        [metric.title, number(values[metric.name][""].mean), metric.unit or DASH, metric.meaning]
        for metric in metrics
        if values[metric.name][""].applies
    ]
