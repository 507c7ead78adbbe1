"""Sending a dataset, to the hub with LeRobot's own upload: only when asked, and only what may leave.

What goes is LeRobot's dataset and the card. `.damaged/`, `.handrail/` and whatever else lies in the folder
stay, and episodes of a user study's participants are not sent at all.
"""

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np
from huggingface_hub.errors import HfHubHTTPError

from handrail.controllers.errors import HandrailError, message_of
from handrail.controllers.regular_file import regular
from handrail.datasets.format.data_file import DataFiles, data_files
from handrail.datasets.presentation.markdown import markdown_table, markdown_text
from handrail.datasets.presentation.table import Table
from handrail.datasets.presentation.wording import DASH, number, percent
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.quality.measure import measure
from handrail.datasets.reading.check import check_whole
from handrail.datasets.reading.episode import Episode
from handrail.datasets.reading.load import recorded_episodes
from handrail.datasets.reading.reader import DatasetInfo, read_episodes, read_info, read_rows_of
from handrail.datasets.storage.atomic import explained, write_whole

CARD = "README.md"
TAGS = ("handrail", "teleoperation")
_MARK = "<!-- written by handrail-edit push -->"
_COUNTED = ("environment", "robot", "operator", "mode", "task")
_NOTES = (
    "The operator steered a part of the motion (`teleop.mode`, `teleop.mask`); a controller completed the"
    " rest. `action` is what was sent to the robot. Handrail's `docs/recording.md` explains every column."
)


def description(root: Path) -> str:
    """Return what was recorded, as Markdown: counts, modes, operators, success and metrics."""
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
    """Write the card with LeRobot's template and return the description in it."""
    path = root / CARD
    if path.exists() and _MARK not in regular(path).read_text(encoding="utf-8", errors="replace"):
        raise HandrailError(
            f"{str(path)!r}: expected none, or one that handrail-edit push wrote; found another, which"
            " LeRobot's upload would replace: give it another name"
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
    metrics = [metric for metric in METRICS if not metric.of_dataset]
    values = measure({"": episodes}, np.random.default_rng(0), metrics=metrics).values
    return [
        [metric.title, number(values[metric.name][""].mean), metric.unit or DASH, metric.meaning]
        for metric in metrics
        if values[metric.name][""].known.size
    ]


SENT = (
    *("data/chunk-*/file-*.parquet", "videos/*/chunk-*/file-*.mp4", "meta/episodes/chunk-*/file-*.parquet"),
    *("meta/info.json", "meta/stats.json", "meta/tasks.parquet", "meta/handrail.json"),
    CARD,
)
_PARTICIPANT, _DEVICE = "participant", "teleop.device"
_PEOPLE = "participants"  # the folder of a user study that has their answers


@dataclass(frozen=True)
class Upload:
    """What is sent, or would be.

    Attributes:
        repo_id: Its name.
        root: The dataset.
        files: Of it, relative to its folder.
        stays: Names in its folder of which nothing is sent.
        size: Of all files [byte].
        private: Whether nobody else sees it.
        license_id: Its licence.
        description: What the card says of it.
        to: Where to, instead of the hub, or "".
    """

    repo_id: str
    root: Path
    files: tuple[str, ...]
    stays: tuple[str, ...]
    size: int
    private: bool
    license_id: str
    description: str
    to: str = ""

    def __str__(self) -> str:
        stays = f"; these stay: {', '.join(self.stays)}" if self.stays else ""
        seen = "private" if self.private else "public"
        where = f"to {self.to}" if self.to else f"as {self.repo_id} ({seen})"
        return f"{self.root} {where}: {len(self.files)} files, {self.size / 1e6:.1f} MB{stays}"


def prepare(
    root: Path, repo_id: str, license_id: str, private: bool, verify: bool = False, to: str = ""
) -> Upload:
    """Check a dataset, write its card, and return what would be sent.

    Args:
        root: Its folder.
        repo_id: Its name on the hub, owner/name.
        license_id: As the hub writes it, such as `cc-by-4.0`.
        private: Whether nobody else is to see it.
        verify: Read every byte anew.
        to: Where to, instead of the hub.
    """
    root = root.absolute()
    check_whole(root, verify)
    check_nobody(root)
    said = write_card(root, repo_id, license_id)
    found = [path for path in sorted(root.rglob("*")) if path.is_file()]
    files = [path for path in found if is_sent(path.relative_to(root).as_posix())]
    home = Path(os.path.realpath(root))
    linked = [each for each in files if Path(os.path.realpath(each)) != home / each.relative_to(root)]
    if linked:
        raise HandrailError(
            f"{str(linked[0])!r}: expected a file of the dataset, found a link; nothing is sent"
        )
    tops, sent = ({path.relative_to(root).parts[0] for path in some} for some in (found, files))
    names = tuple(path.relative_to(root).as_posix() for path in files)
    size = sum(path.stat().st_size for path in files)
    return Upload(repo_id, root, names, tuple(sorted(tops - sent)), size, private, license_id, said, to)


def upload(push: Upload) -> None:
    """Send a dataset with LeRobot's `push_to_hub`."""
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    try:
        LeRobotDataset(push.repo_id, root=push.root).push_to_hub(
            tags=list(TAGS),
            license=push.license_id,
            private=push.private,
            allow_patterns=list(SENT),
            dataset_description=push.description,
        )
    except (OSError, ValueError, RuntimeError, HfHubHTTPError) as error:
        said = message_of(error).partition("\n")[0]
        raise HandrailError(f"--upload: the hub did not take {push.repo_id}: {said}") from error


def is_sent(name: str) -> bool:
    """Return whether a file, by its path in the dataset, is one that goes to the hub."""
    return any(fnmatch(name, pattern) for pattern in SENT) and not name.startswith(".")


def check_nobody(root: Path) -> None:
    """Check that no episode is a participant's: data of people do not leave by a flag."""
    above = [folder for folder in root.parents[:4] if (folder / _PEOPLE).is_dir()]
    if above:
        raise HandrailError(f"dataset {str(root)!r}: part of the user study in {above[0]}; it is never sent")
    info, rows = read_info(root), read_episodes(root)
    people = [row["episode_index"] for row in rows if row.get(_PARTICIPANT)]
    if people:
        others = [row["episode_index"] for row in rows if not row.get(_PARTICIPANT)]
        advice = f"handrail-edit keep --episodes {_few(others)} leaves them out" if others else "all are"
        raise HandrailError(
            f"dataset {str(root)!r}: episodes {_few(people)} are of participants of a user study, which are"
            f" never sent; {advice}"
        )
    with data_files() as files:
        driven = [row for row in rows if _PARTICIPANT not in row and _driven(info, row, files)]
    unknown = [row["episode_index"] for row in driven]
    if unknown:
        raise HandrailError(
            f"dataset {str(root)!r}: people drove episodes {_few(unknown)}, and another tool has dropped who,"
            " so they may be of participants of a user study; send the dataset that Handrail recorded"
        )


def _driven(info: DatasetInfo, row: dict[str, Any], files: DataFiles) -> bool:
    """Return whether a person drove an episode."""
    if _DEVICE not in info.features:
        return False
    return bool(np.any(read_rows_of(info, row, [_DEVICE], files)[_DEVICE] != ""))


def _few(numbers: Sequence[int]) -> str:
    """Return numbers as a command line takes them, runs as ranges."""
    runs: list[list[int]] = []
    for each in numbers:
        if runs and each == runs[-1][1] + 1:
            runs[-1][1] = each
        else:
            runs.append([each, each])
    return ",".join(str(first) if first == last else f"{first}-{last}" for first, last in runs)
