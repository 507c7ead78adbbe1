"""Settings of `handrail-edit`, a class for each verb that writes episodes; light to import."""

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import tyro

from handrail.controllers.errors import HandrailError
from handrail.datasets.lists import Words
from handrail.datasets.storage.atomic import followed

MANY = 500  # episodes in files of their own


@dataclass(frozen=True, kw_only=True)
class EditConfig:
    """Settings that all of these verbs need."""

    verb: ClassVar[str]
    needed: ClassVar[tuple[str, ...]] = ()
    """Settings that may not be empty."""

    folder: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="FOLDER")]
    """Folder of the dataset."""
    output: str = ""
    """Folder of the new dataset, or for the parts of split."""
    in_place: bool = False
    """Replace the dataset instead (not with split, render); what is left out is gone."""
    name: str = ""
    """Name of the new dataset, owner/name; that of the old one when empty."""
    verify: bool = False
    """Read every file of the dataset anew, not only those that have changed since they were checked."""

    @property
    def root(self) -> Path:
        """The folder of the dataset."""
        return followed(self.folder)

    @property
    def target(self) -> Path:
        """The folder of what is written."""
        return _apart(self.output, self.root) if self.output else self.root

    def check(self) -> None:
        """Check what can be checked without reading anything."""
        if bool(self.output) == self.in_place:
            got = "both" if self.in_place else "neither"
            raise HandrailError(f"{self.verb}: expected --output NEW_FOLDER or --in_place, got {got}")
        if self.output and self.target == self.root:
            raise HandrailError(f"--output {self.output}: expected a folder apart from {self.root}")
        for name in self.needed:
            if not getattr(self, name):
                raise HandrailError(f"{self.verb}: expected --{name}, got none")


@dataclass(frozen=True, kw_only=True)
class DeleteConfig(EditConfig):
    """Write a dataset without some of its episodes; every column stays."""

    verb = "delete"
    needed = ("episodes",)
    episodes: Words = ()
    """Which episodes to leave out: 3, 0-4, failed, succeeded."""


@dataclass(frozen=True, kw_only=True)
class KeepConfig(EditConfig):
    """Write a dataset with only some of its episodes; every column stays."""

    verb = "keep"
    needed = ("episodes",)
    episodes: Words = ()
    """Which episodes to keep: 3, 0-4, failed, succeeded."""


@dataclass(frozen=True, kw_only=True)
class SplitConfig(EditConfig):
    """Write the parts of a dataset into folders of their own; every column stays."""

    verb = "split"
    needed = ("parts", "output")
    parts: Words = ()
    """NAME=SHARE, such as train=0.8 test=0.2; or NAME=EPISODES, such as test=3,5-7."""


@dataclass(frozen=True, kw_only=True)
class TrimConfig(EditConfig):
    """Cut off what is idle at both ends of episodes; every column stays."""

    verb = "trim"
    episodes: Words = ()
    """Which episodes: 3, 0-4, failed, succeeded; all by default."""
    margin: float = 0.25
    """Time to leave before the first motion and after the last [s]."""

    def check(self) -> None:
        """Check what can be checked without reading anything."""
        super().check()
        if not 0.0 <= self.margin < float("inf"):
            raise HandrailError(f"--margin {self.margin}: expected a time of 0 or more [s]")


@dataclass(frozen=True, kw_only=True)
class RelabelConfig(EditConfig):
    """Say how episodes ended; every column stays."""

    verb = "relabel"
    needed = ("episodes", "label")
    episodes: Words = ()
    """Which episodes: 3, 0-4, failed, succeeded."""
    label: Literal["", "success", "failure"] = ""
    """How they ended."""
    reason: str = ""
    """Why they failed, in words."""

    def check(self) -> None:
        """Check what can be checked without reading anything."""
        super().check()
        if self.reason and self.label != "failure":
            raise HandrailError("--reason: expected it with --label failure")


@dataclass(frozen=True, kw_only=True)
class RenameConfig(EditConfig):
    """Give the task of episodes another sentence; every column stays."""

    verb = "rename"
    needed = ("task",)
    task: str = ""
    """The new sentence."""
    old_task: str = ""
    """The sentence that it replaces; all of them when empty."""
    episodes: Words = ()
    """Which episodes: 3, 0-4, failed, succeeded; all by default."""


@dataclass(frozen=True)
class PackConfig:
    """Write a dataset's episodes into few large files, as LeRobot does; nothing is encoded anew."""

    folder: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="FOLDER")]
    """Folder of the dataset."""
    output: str = ""
    """Folder of the packed dataset; when empty, it takes the place of the old one."""
    name: str = ""
    """Name of the packed dataset, owner/name; that of the old one when empty."""
    verify: bool = False
    """Read every file of the dataset anew, not only those that have changed since they were checked."""

    @property
    def roots(self) -> tuple[Path, ...]:
        """The folders of the datasets."""
        return (followed(self.folder),)

    @property
    def target(self) -> Path:
        """The folder of what is written."""
        return _apart(self.output, *self.roots) if self.output else self.roots[0]


@dataclass(frozen=True)
class MergeConfig:
    """Write the episodes of several datasets, in their order, into one, in few large files."""

    folders: Annotated[tyro.conf.Positional[Words], tyro.conf.arg(metavar="FOLDER FOLDER [FOLDER …]")]
    """Folders of the datasets."""
    output: str = ""
    """Folder of the new dataset; with --in_place one of the folders, which the new dataset replaces."""
    in_place: bool = False
    """Let the new dataset replace one of the folders, the one that --output names."""
    name: str = ""
    """Name of the new dataset, owner/name; that of the first folder when empty."""
    verify: bool = False
    """Read every file of the datasets anew, not only those that have changed since they were checked."""

    @property
    def roots(self) -> tuple[Path, ...]:
        """The folders of the datasets."""
        if len(self.folders) < 2:
            raise HandrailError(f"merge: expected two folders or more, got {len(self.folders)}")
        return tuple(followed(folder) for folder in self.folders)

    @property
    def target(self) -> Path:
        """The folder of what is written."""
        if not self.output:
            raise HandrailError("merge: expected --output FOLDER for the new dataset, got none")
        target = _apart(self.output, *self.roots)
        if self.in_place != (target in self.roots):
            which = "one of the folders" if self.in_place else "another folder, or --in_place to replace it"
            raise HandrailError(f"--output {self.output}: expected {which}")
        return target


def packing_advice(root: Path) -> str:
    """Return how to pack a dataset that is slow to open, or that LeRobot cannot stream yet, or ""."""
    count, cameras, videos = (len(list(root.glob(each))) for each in ("data/*/*", "videos/*", "videos/*/*/*"))
    command = f"handrail-edit pack {shlex.quote(str(root))}"
    if count > MANY:
        return f"{count} files of rows are slow to open: {command} makes few of them"
    if videos > cameras:
        return f"LeRobot's StreamingLeRobotDataset expects one video a camera: {command} before streaming"
    return ""


def _apart(output: str, *roots: Path) -> Path:
    target = followed(output)
    for root in roots:
        if root in target.parents or target in root.parents:
            raise HandrailError(f"--output {output}: expected a folder apart from {root}")
    return target
