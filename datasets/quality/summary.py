"""One line an episode: what was done, how it ended, how smooth and how safe it was.

What a dataset does not hold stays None and is shown as "–", so that any LeRobot dataset can be looked at.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.format.columns import CLIENT
from handrail.datasets.quality import motion, safety
from handrail.datasets.quality.metric import Metric
from handrail.datasets.quality.metrics import corrections, high_frequency_content, rate_of_change
from handrail.datasets.quality.pool import ObservationPool
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply
from handrail.datasets.reading.load import each_demonstration

UNKNOWN = "–"
CHATTERING = (
    "rate of change",
    "high-frequency content",
    "corrections",
)  # a table of its own
ASKED, OWNED = "teleop.values", "teleop.mask"


@dataclass(frozen=True)
class EpisodeSummary:
    """One episode at a glance.

    Attributes:
        episode: Its number.
        task: Its task sentences, joined by "; ".
        mode: Its teleop modes, in the order in which they first occur, joined by " → ".
        success: How it ended.
        failure_reason: Why it failed.
        length: Duration [s].
        smallest_distance: Smallest distance to a collision [m].
        smoothness: SPARC of the tool's speed, or else of the configuration's.
        contacts: How many unwanted contacts began.
        rate_of_change: Of the commanded velocities, see `metrics.rate_of_change`.
        high_frequency_content: Of the commanded velocities, see `metrics.high_frequency_content`.
        corrections: How often the command began or ceased to differ from what was asked, on the joints that
            the operator commanded one by one; None without any: what is not commanded is not corrected.
        robot_client: The robot of LeRobot's that was driven through its client; None if it was none.
    """

    episode: int
    task: str
    mode: str | None
    success: bool | None
    failure_reason: str | None
    length: float
    smallest_distance: float | None
    smoothness: float | None
    contacts: int | None
    rate_of_change: float | None
    high_frequency_content: float | None
    corrections: int | None
    robot_client: str | None = None

    def cells(self) -> dict[str, str]:
        """Return the line as text, by heading."""
        success = None if self.success is None else ("yes" if self.success else "no")
        return {
            "episode": str(self.episode),
            "task": self.task or UNKNOWN,
            "mode": self.mode or UNKNOWN,
            "success": success or UNKNOWN,
            "why not": self.failure_reason or UNKNOWN,
            "length [s]": f"{self.length:.1f}",
            "smallest distance [m]": _number(self.smallest_distance, "{:.3f}"),
            "smoothness": _number(self.smoothness, "{:.2f}"),
            "contacts begun": _number(self.contacts, "{:d}"),
            "rate of change": _number(self.rate_of_change, "{:.2f}"),
            "high-frequency content": _number(self.high_frequency_content, "{:.2f}"),
            "corrections": _number(self.corrections, "{:d}"),
        }


def summarize(root: str | Path) -> list[EpisodeSummary]:
    """Return one summary an episode, in order.

    Args:
        root: The folder of any LeRobot v3.0 dataset.
    """
    return [_summary(episode) for episode in each_demonstration(root)]


def _summary(episode: Demonstration) -> EpisodeSummary:
    contacts, commands = _measured(safety.contacts, episode), _commands(episode)
    return EpisodeSummary(
        episode=episode.number,
        task="; ".join(episode.meta["tasks"]),
        mode=episode.modes or episode.meta.get("mode") or None,
        success=episode.success,
        failure_reason=episode.meta.get("failure_reason") or None,
        length=episode.seconds,
        smallest_distance=_measured(safety.smallest_distance, episode),
        smoothness=_measured(motion.smoothness, episode),
        contacts=None if contacts is None else int(contacts),
        rate_of_change=_known(rate_of_change(commands, episode.fps)),
        high_frequency_content=_known(high_frequency_content(commands, episode.fps)),
        corrections=_corrections(episode),
        robot_client=episode.meta.get(CLIENT) or None,
    )


def _measured(metric: Metric, episode: Demonstration) -> float | None:
    try:
        return metric.measure(episode, ObservationPool()) if metric.measure else None
    except DoesNotApply:
        return None


def _commands(episode: Demonstration) -> FloatArray:
    """Return the commanded velocities, `(N, n)`; none for another tool's action, which may be a position."""
    names = episode.entries("action") if episode.info.from_handrail else ()
    moving = [index for index, name in enumerate(names) if "gripper" not in name]
    return episode.numbers("action")[:, moving] if moving else np.empty((0, 0))


def _corrections(episode: Demonstration) -> int | None:
    """Return how often the correction of a joint's command switched, if the operator commanded any joint."""
    given = [episode.frames.get(name, np.empty(0)) for name in (ASKED, OWNED)]
    if not episode.has("action") or any(each.dtype.kind not in "fiub" or not each.size for each in given):
        return None
    channels = {name: index for index, name in enumerate(episode.info.features[ASKED].names or ())}
    joints = [
        (index, channels[f"joint.{name.removeprefix('v_')}"])
        for index, name in enumerate(episode.entries("action"))
        if f"joint.{name.removeprefix('v_')}" in channels
    ]
    sent, places = np.array(joints, dtype=int).reshape(-1, 2).T
    asked, owned = (each[:, places] for each in given)
    return corrections(asked, episode.numbers("action")[:, sent], owned) if owned.any() else None


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _number(value: float | None, pattern: str) -> str:
    return UNKNOWN if value is None else pattern.format(value)
