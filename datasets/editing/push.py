"""Sending a dataset, to the hub with LeRobot's own upload or to a store: only when asked, and what may leave.

LeRobot's dataset and the card are sent. `.damaged/`, `.handrail/` and all else that lies in the folder
stay, and episodes of a user study's participants are not sent at all.
"""

from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from itertools import groupby
from pathlib import Path

import fsspec
import numpy as np
from huggingface_hub import HfApi

from handrail.controllers.errors import HandrailError, message_of, restated
from handrail.controllers.regular_file import regular
from handrail.datasets.format.layout import Layout
from handrail.datasets.presentation.markdown import markdown_table, markdown_text
from handrail.datasets.presentation.table import Table
from handrail.datasets.presentation.wording import DASH, number, percent
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.quality.measure import measure
from handrail.datasets.reading.check import check_whole
from handrail.datasets.reading.load import some_recorded
from handrail.datasets.reading.reader import open_dataset, read_info
from handrail.datasets.storage.atomic import check_room, explained, write_whole

CARD = "README.md"
PREVIEW = "meta/preview.webp"
TAGS = ("handrail", "teleoperation")
SENT = (
    *("data/chunk-*/file-*.parquet", "videos/*/chunk-*/file-*.mp4", "meta/episodes/chunk-*/file-*.parquet"),
    *("meta/info.json", "meta/stats.json", "meta/tasks.parquet", "meta/handrail.json"),
    *(PREVIEW, CARD),
)
_LAST = "meta/info.json"  # without it nobody takes a folder for a dataset
_PARTICIPANT, _DEVICE = "participant", "teleop.device"
_PEOPLE = "participants"  # the folder of a user study that has their answers
_MARK = "<!-- written by handrail-edit push -->"
_COUNTED = ("environment", "robot", "operator", "mode")
_NOTES = (
    "The operator steered a part of the motion (`teleop.mode`, `teleop.mask`); a controller completed the"
    " rest. `action` is the command sent to the robot. Handrail's `docs/recording.md` explains every column."
)


@dataclass(frozen=True)
class Upload:
    """A dataset that is sent, or would be."""

    repo_id: str
    root: Path
    files: tuple[str, ...]
    """Its files that are sent, relative to its folder."""
    stays: tuple[str, ...]
    """Names in its folder of which nothing is sent."""
    size: int
    """Of all files [byte]."""
    private: bool
    """Whether nobody else sees it."""
    license_id: str
    description: str
    """Its description on the card."""
    to: str = ""
    """Its place, instead of the hub, or ""."""

    def __str__(self) -> str:
        stays = f"; these stay: {', '.join(self.stays)}" if self.stays else ""
        seen = "private" if self.private else "public"
        where = f"to {self.to}" if self.to else f"as {self.repo_id} ({seen}, {self.license_id})"
        return f"{self.root} {where}: {len(self.files)} files, {self.size / 1e6:.1f} MB{stays}"


def prepare(
    root: Path,
    repo_id: str,
    license_id: str,
    private: bool,
    verify: bool = False,
    to: str = "",
    preview: Callable[[Path], bytes] | None = None,
) -> Upload:
    """Check a dataset, write its card, and return what would be sent.

    Args:
        root: Its folder.
        repo_id: Its name on the hub, owner/name.
        license_id: As the hub writes it, such as `cc-by-4.0`.
        private: Whether nobody else is to see it.
        verify: Read every byte anew.
        to: Where to, instead of the hub.
        preview: Draws a picture of a dataset that has none, as WebP; b"" where it cannot.
    """
    root = root.absolute()
    check_whole(root, verify)
    _check_nobody(root)
    kinds = {feature.dtype for feature in read_info(root).features.values()}
    if preview and kinds.isdisjoint(("video", "image")) and (picture := preview(root)):
        with explained(f"cannot write {str(root / PREVIEW)!r}"):
            write_whole(root / PREVIEW, picture)
    said = _write_card(root, repo_id, license_id)
    names = [path.relative_to(root).as_posix() for path in sorted(root.rglob("*")) if path.is_file()]
    files = [name for name in names if _is_sent(name)]
    foreign = Layout(root).foreign(read_info(root).features)
    if mixed := [name for name in foreign if _is_sent(name) or (root / name).is_symlink()]:
        raise HandrailError(f"{str(root / mixed[0])!r}: no file of the dataset, or a link; move it away")
    tops, sent = ({name.split("/")[0] for name in some} for some in (names, files))
    size = sum((root / name).stat().st_size for name in files)
    stays = tuple(sorted(tops - sent))
    return Upload(repo_id, root, tuple(files), stays, size, private, license_id, said, to)


def upload(push: Upload) -> None:
    """Send a dataset with LeRobot's `push_to_hub`."""
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    try:
        _check_hub(push)
        LeRobotDataset(push.repo_id, root=push.root).push_to_hub(
            tags=list(TAGS),
            license=push.license_id,
            private=push.private,
            allow_patterns=list(SENT),
            dataset_description=push.description,
        )
    except HandrailError:
        raise
    except Exception as error:  # of the hub's client and the network
        raise HandrailError(f"--upload: the hub did not take {push.repo_id}: {message_of(error)}") from error


def free_place(to: str, sent: Collection[str] = ()) -> tuple[fsspec.AbstractFileSystem, str]:
    """Return the store that an address names, and the place in it, once a dataset may be copied there.

    Args:
        to: The address, of a file system that fsspec knows.
        sent: The files of the dataset; some may be there, of a copy cut short.
    """
    with restated(f"--to {to}"):  # every store fails in ways of its own
        system, place = fsspec.url_to_fs(to)
        place = place.rstrip("/")
        system.invalidate_cache()
        found = system.find(place) if system.exists(place) else []
    names = {path.removeprefix(f"{place}/") for path in found}
    if to.startswith(("file://", "local://")):
        check_room(f"--to {to}", Path(place))
    if _LAST in names or (sent and not names <= set(sent)):
        raise HandrailError(
            f"--to {to}: expected nothing there, or a copy of this dataset that was cut short; found"
            f" {len(names)} files; choose another place"
        )
    return system, place


def copy(push: Upload) -> None:
    """Copy a dataset to its place."""
    system, place = free_place(push.to, push.files)
    with restated(f"--to {push.to}: the dataset could not be copied there"):
        for name in sorted(push.files, key=lambda name: name == _LAST):
            target = f"{place}/{name}"
            system.makedirs(target.rpartition("/")[0], exist_ok=True)
            system.put_file(str(push.root / name), target)
            sizes = (push.root / name).stat().st_size, system.size(target)
            if sizes[0] != sizes[1]:
                raise OSError(f"{name} has {sizes[1]} bytes there, expected {sizes[0]}")


def _check_nobody(root: Path) -> None:
    """Check that no episode is a participant's: data of people do not leave by a flag."""
    above = [folder for folder in root.parents[:4] if (folder / _PEOPLE).is_dir()]
    if above:
        raise HandrailError(f"dataset {str(root)!r}: part of the user study in {above[0]}; it is never sent")
    with open_dataset(root) as dataset:
        rows = dataset.rows
        people = [row["episode_index"] for row in rows if row.get(_PARTICIPANT)]
        if people:
            others = [row["episode_index"] for row in rows if not row.get(_PARTICIPANT)]
            advice = f"handrail-edit keep --episodes {_few(others)} leaves them out" if others else "all are"
            raise HandrailError(
                f"dataset {str(root)!r}: episodes {_few(people)} are of participants of a user study, which"
                f" are never sent; {advice}"
            )
        known = _DEVICE in dataset.info.features
        suspects = [row["episode_index"] for row in rows if known and row.get(_PARTICIPANT) is None]
        unknown = [each for each in suspects if any(dataset.frames(each, [_DEVICE])[_DEVICE] != "")]
    if unknown:
        raise HandrailError(
            f"dataset {str(root)!r}: people drove episodes {_few(unknown)}, and another tool has dropped who,"
            " so they may be of participants of a user study; send the dataset that Handrail recorded"
        )


def _check_hub(push: Upload) -> None:
    """Check that what is on the hub under this name is as private as asked, and no larger."""
    hub = HfApi()
    if not hub.repo_exists(push.repo_id, repo_type="dataset"):
        return
    if push.private and not hub.repo_info(push.repo_id, repo_type="dataset").private:
        raise HandrailError(
            f"--upload: {push.repo_id} is on the hub and public: say --no_private, or make it private there"
        )
    there = {name for name in hub.list_repo_files(push.repo_id, repo_type="dataset") if _is_sent(name)}
    if stale := sorted(there - set(push.files)):
        raise HandrailError(
            f"--upload: {push.repo_id} on the hub has {len(stale)} files that this dataset has not, such as"
            f" {stale[0]}; LeRobot would read them as episodes: delete them there, or choose another name"
        )


def _is_sent(name: str) -> bool:
    return any(fnmatch(name, pattern) for pattern in SENT) and name[0] != "."


def _few(numbers: Sequence[int]) -> str:
    """Return numbers as a command line takes them, runs as ranges."""
    groups = groupby(enumerate(numbers), lambda each: each[1] - each[0])  # the same in a run
    runs = [[number for _, number in run] for _, run in groups]
    return ",".join(str(run[0]) if len(run) == 1 else f"{run[0]}-{run[-1]}" for run in runs)


def _write_card(root: Path, repo_id: str, license_id: str) -> str:
    """Write the card with LeRobot's template and return the description in it."""
    path = root / CARD
    if path.exists() and _MARK not in regular(path).read_text(encoding="utf-8", errors="replace"):
        raise HandrailError(
            f"{str(path)!r}: expected none, or one that handrail-edit push wrote; found another, which"
            " LeRobot's upload would replace: give it another name"
        )
    from lerobot.datasets.io_utils import load_info
    from lerobot.datasets.utils import create_lerobot_dataset_card

    said = _description(root)
    trouble = f"dataset {str(root)!r}: LeRobot cannot read meta/info.json"
    with restated(trouble, (AttributeError, TypeError, ValueError)):
        info = load_info(root)
    told = {"license": license_id, "repo_id": repo_id, "dataset_description": said}
    card = create_lerobot_dataset_card(tags=list(TAGS), dataset_info=info, **told)
    with explained(f"cannot write {str(path)!r}"):
        write_whole(path, str(card).encode())
    return said


def _description(root: Path) -> str:
    """Return what was recorded, as Markdown: counts, modes, operators, success and metrics."""
    episodes = some_recorded(root)
    info, metas = episodes[0].info, [episode.meta for episode in episodes]
    frames = sum(episode.count for episode in episodes)
    counted = {name: _counted([meta.get(name) for meta in metas]) for name in _COUNTED}
    counted["task"] = _counted([task for meta in metas for task in meta["tasks"]])
    ended = [episode.success for episode in episodes if episode.success is not None]
    if ended:
        counted["success"] = f"{sum(ended)} of {len(ended)} ({percent(sum(ended) / len(ended))})"
    failed = [episode.meta.get("failure_reason") for episode in episodes if episode.success is False]
    counted["failures"] = _counted(failed)
    lines = (
        f"{len(episodes)} episodes, {frames} frames at {info.fps} Hz, {frames / info.fps / 60:.1f} minutes",
        f"robot {markdown_text(info.robot_type) or DASH}",
        *(f"{name}: {said}" for name, said in counted.items() if said),
    )
    listed = "\n".join(f"- {line}" for line in lines)
    asked = [metric for metric in METRICS if not metric.of_dataset]
    measured = measure({"": episodes}, np.random.default_rng(0), metrics=asked)
    values = measured.values
    rows = [
        [metric.title, number(values[metric.name][""].estimate), metric.unit or DASH, metric.meaning]
        for metric in measured.metrics
        if values[metric.name][""].known.size
    ]
    table = markdown_table(Table(("metric", "mean", "unit", "meaning"), rows))
    picture = f"![An episode]({PREVIEW})\n\n" if (root / PREVIEW).is_file() else ""
    return f"{_MARK}\n\n{picture}{listed}\n\n{_NOTES if info.from_handrail else ''}\n\n{table}"


def _counted(values: Sequence[object]) -> str:
    """Return values and how many episodes have each; empty ones are left out."""
    counts = Counter(value for value in values if value)
    return ", ".join(f"{markdown_text(str(value))} ({count})" for value, count in counts.most_common())
