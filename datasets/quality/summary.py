"""One line an episode: what was done, how it ended, how smooth and how safe it was.

What a dataset does not hold stays None and is shown as "–", so that any LeRobot dataset can be looked at.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from handrail.datasets.format.schema import NUMBERS
from handrail.datasets.quality.metrics import corrections, high_frequency_content, rate_of_change, sparc
from handrail.datasets.quality.safety import contacts_begun
from handrail.datasets.reading.labels import with_success
from handrail.datasets.reading.reader import DatasetInfo, read_episodes, read_info, read_rows_of

UNKNOWN = "–"
HEADINGS = (
    "episode",
    "task",
    "mode",
    "success",
    "why not",
    "length [s]",
    "smallest distance [m]",
    "smoothness",
    "contacts begun",
)
QUALITY_HEADINGS = (
    "episode",
    "mode",
    "length [s]",
    "smoothness",
    "rate of change",
    "high-frequency content",
    "corrections",
)
TOOL = ("tool.x", "tool.y", "tool.z")
STATE, ACTION = "observation.state", "action"
ASKED, OWNED = "teleop.values", "teleop.mask"
MODE, DISTANCE, CONTACTS = "teleop.mode", "controller.smallest_distance", "safety.contacts"


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
        smoothness: SPARC of the tool's speed, or else of the norm of the commanded velocity.
        contacts: How many unwanted contacts began.
        rate_of_change: Of the commanded velocities, see `metrics.rate_of_change`.
        high_frequency_content: Of the commanded velocities, see `metrics.high_frequency_content`.
        corrections: How often the command began or ceased to differ from what was asked, on the joints that
            the operator commanded one by one; None without any: what is not commanded is not corrected.
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

    def cells(self) -> tuple[str, ...]:
        """Return the line as text, one cell for each of `HEADINGS`."""
        success = None if self.success is None else ("yes" if self.success else "no")
        return (
            str(self.episode),
            self.task or UNKNOWN,
            self.mode or UNKNOWN,
            success or UNKNOWN,
            self.failure_reason or UNKNOWN,
            f"{self.length:.1f}",
            _number(self.smallest_distance, "{:.3f}"),
            _number(self.smoothness, "{:.2f}"),
            _number(self.contacts, "{:d}"),
        )

    def quality_cells(self) -> tuple[str, ...]:
        """Return the measures of quality as text, one cell for each of `QUALITY_HEADINGS`."""
        return (
            str(self.episode),
            self.mode or UNKNOWN,
            f"{self.length:.1f}",
            _number(self.smoothness, "{:.2f}"),
            _number(self.rate_of_change, "{:.2f}"),
            _number(self.high_frequency_content, "{:.2f}"),
            _number(self.corrections, "{:d}"),
        )


def summarize(root: str | Path) -> list[EpisodeSummary]:
    """Return one summary an episode, in order.

    Args:
        root: The folder of any LeRobot v3.0 dataset.

    Raises:
        HandrailError: There is no dataset, or a file of it cannot be read.
    """
    info = read_info(root)
    known = dict.fromkeys((STATE, ACTION, ASKED, OWNED, DISTANCE, CONTACTS), NUMBERS) | {MODE: ("string",)}
    wanted = [name for name, dtypes in known.items() if _is_column(info, name, dtypes)]
    rows = with_success(info, read_episodes(root))
    return [_summary(info, row, read_rows_of(info, row, wanted)) for row in rows]


def _summary(info: DatasetInfo, row: dict[str, Any], frames: dict[str, np.ndarray]) -> EpisodeSummary:
    distance = _finite(frames.get(DISTANCE))
    contacts = frames.get(CONTACTS)
    commands = _commands(info, frames)
    return EpisodeSummary(
        episode=row["episode_index"],
        task="; ".join(row["tasks"]),
        mode=_mode(row, frames),
        success=_as_bool(row.get("success")),
        failure_reason=row.get("failure_reason") or None,
        length=row["length"] / info.fps,
        smallest_distance=None if distance is None else float(distance.min()),
        smoothness=_smoothness(info, frames),
        contacts=None if contacts is None or contacts.ndim != 1 else int(contacts_begun(contacts)),
        rate_of_change=None if commands is None else _known(rate_of_change(commands, info.fps)),
        high_frequency_content=None
        if commands is None
        else _known(high_frequency_content(commands, info.fps)),
        corrections=_corrections(info, frames),
    )


def _mode(row: dict[str, Any], frames: dict[str, np.ndarray]) -> str | None:
    modes = [str(mode) for mode in dict.fromkeys(frames.get(MODE, ())) if mode]
    return " → ".join(modes) or row.get("mode") or None


def _smoothness(info: DatasetInfo, frames: dict[str, np.ndarray]) -> float | None:
    speed = _tool_speed(info, frames)
    if speed is None:
        commands = _commands(info, frames)
        speed = None if commands is None else np.linalg.norm(commands, axis=1)
    return None if speed is None else _known(sparc(speed, info.fps))


def _tool_speed(info: DatasetInfo, frames: dict[str, np.ndarray]) -> np.ndarray | None:
    """Return the tool's speed [m/s], `(N − 1,)`, if the state names its position."""
    names = info.features[STATE].names if STATE in frames else None
    if not names or any(name not in names for name in TOOL):
        return None
    positions = frames[STATE][:, [names.index(name) for name in TOOL]].astype(float)
    return np.linalg.norm(np.diff(positions, axis=0), axis=1) * info.fps


def _commands(info: DatasetInfo, frames: dict[str, np.ndarray]) -> np.ndarray | None:
    """Return the commanded velocities, `(N, n)`; another tool's action may be a position."""
    names = info.features[ACTION].names if ACTION in frames and info.from_handrail else None
    if not names or frames[ACTION].ndim != 2:
        return None
    moving = [index for index, name in enumerate(names) if "gripper" not in name]
    return frames[ACTION][:, moving].astype(float)


def _corrections(info: DatasetInfo, frames: dict[str, np.ndarray]) -> int | None:
    """Return how often the correction of a joint's command switched, if the operator commanded any joint."""
    if not {ACTION, ASKED, OWNED} <= set(frames):
        return None
    channels = {name: index for index, name in enumerate(info.features[ASKED].names or ())}
    joints = [
        (index, channels[f"joint.{name.removeprefix('v_')}"])
        for index, name in enumerate(info.features[ACTION].names or ())
        if f"joint.{name.removeprefix('v_')}" in channels
    ]
    sent, asked = np.array(joints, dtype=int).reshape(-1, 2).T
    owned = frames[OWNED][:, asked]
    return corrections(frames[ASKED][:, asked], frames[ACTION][:, sent], owned) if owned.any() else None


def _finite(values: np.ndarray | None) -> np.ndarray | None:
    finite = None if values is None else values[np.isfinite(values)]
    return finite if finite is not None and finite.size else None


def _is_column(info: DatasetInfo, name: str, dtypes: Sequence[str]) -> bool:
    return name in info.features and info.features[name].dtype in dtypes


def _as_bool(value: Any) -> bool | None:
    return bool(value) if isinstance(value, bool | int | float) else None


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _number(value: float | None, pattern: str) -> str:
    return UNKNOWN if value is None else pattern.format(value)
