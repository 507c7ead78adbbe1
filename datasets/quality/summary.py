"""One line an episode: how it went and how it ended; what a dataset does not hold is None, shown as "–"."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.format.metadata import CLIENT
from handrail.datasets.presentation.wording import DASH, yes_no
from handrail.datasets.quality import motion, safety
from handrail.datasets.quality.metric import Metric
from handrail.datasets.quality.metrics import corrections, high_frequency_content, rate_of_change
from handrail.datasets.quality.scale import Scale
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply
from handrail.datasets.reading.load import each_opened, recorded_episodes

CHATTERING = ("rate of change", "high-frequency content", "corrections")  # a table of its own
ASKED, OWNED = "teleop.values", "teleop.mask"


@dataclass(frozen=True)
class EpisodeSummary:
    """One episode at a glance."""

    episode: int
    task: str  # sentences, joined by "; "
    mode: str | None  # teleop modes in the order in which they first occur, joined by " → "
    success: bool | None
    failure_reason: str | None
    length: float  # [s]
    smallest_distance: float | None  # to a collision [m]
    smoothness: float | None  # SPARC of the tool's speed, or else of the configuration's
    contacts: int | None  # unwanted ones that began
    rate_of_change: float | None  # of the commanded velocities, see `metrics`
    high_frequency_content: float | None  # of the commanded velocities, see `metrics`
    corrections: int | None  # see `metrics`; of the joints that were commanded one by one, None without any
    robot_client: str | None = None  # LeRobot's client that drove the robot
    hands: Mapping[str, float | None] = field(default_factory=dict)  # smoothness of each hand of several

    def cells(self) -> dict[str, str]:
        """Return the line as text, by heading."""
        return {
            "episode": str(self.episode),
            "task": self.task or DASH,
            "mode": self.mode or DASH,
            "success": yes_no(self.success),
            "why not": self.failure_reason or DASH,
            "length [s]": f"{self.length:.1f}",
            "smallest distance [m]": _number(self.smallest_distance, ".3f"),
            "smoothness": _number(self.smoothness, ".2f"),
            **{f"smoothness, {hand}": _number(each, ".2f") for hand, each in self.hands.items()},
            "contacts begun": _number(self.contacts, "d"),
            "rate of change": _number(self.rate_of_change, ".2f"),
            "high-frequency content": _number(self.high_frequency_content, ".2f"),
            "corrections": _number(self.corrections, "d"),
        }


def summarize(root: str | Path) -> list[EpisodeSummary]:
    """Return one summary an episode of any LeRobot v3.0 dataset, in order."""
    return [_summary(episode) for episode in each_opened(recorded_episodes(root))]


def _summary(episode: Demonstration) -> EpisodeSummary:
    commands, began = _commands(episode), episode.meta.get("contact_onsets")  # between frames, too
    contacts = began if isinstance(began, int) else _measured(safety.contacts, episode)
    return EpisodeSummary(
        episode=episode.number,
        task="; ".join(episode.meta["tasks"]),
        mode=episode.modes or episode.meta.get("mode") or None,
        success=episode.success,
        failure_reason=episode.meta.get("failure_reason") or None,
        length=episode.seconds,
        smallest_distance=_measured(safety.smallest_distance, episode),
        smoothness=_measured(motion.sparc, episode),
        contacts=None if contacts is None else int(contacts),
        rate_of_change=_known(rate_of_change(commands, episode.fps)),
        high_frequency_content=_known(high_frequency_content(commands, episode.fps)),
        corrections=_corrections(episode),
        robot_client=episode.meta.get(CLIENT) or None,
        hands={hand: _measured(motion.sparc.of_hand(hand), episode) for hand in episode.hands},
    )


def _measured(metric: Metric, episode: Demonstration) -> float | None:
    try:
        return metric.measure(episode, Scale())
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
    joints = [f"joint.{name.removeprefix('v_')}" for name in episode.entries("action")]
    sent = [index for index, name in enumerate(joints) if name in channels]
    places = [channels[joints[index]] for index in sent]
    asked, owned = (each[:, places] for each in given)
    return corrections(asked, episode.numbers("action")[:, sent], owned) if owned.any() else None


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _number(value: float | None, pattern: str) -> str:
    return DASH if value is None else format(value, pattern)
