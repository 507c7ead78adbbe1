"""Settings of `handrail-edit pack` and `handrail-edit merge`; light to import."""

import os
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from handrail.controllers.errors import HandrailError
from handrail.datasets.lists import Words

MANY = 500  # episodes in files of their own


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
        return (Path(self.folder).expanduser().absolute(),)

    @property
    def target(self) -> Path:
        """The folder of what is written."""
        return _apart(self.output, self.roots) if self.output else self.roots[0]


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
        return tuple(Path(folder).expanduser().absolute() for folder in self.folders)

    @property
    def target(self) -> Path:
        """The folder of what is written."""
        if not self.output:
            raise HandrailError("merge: expected --output FOLDER for the new dataset, got none")
        target = _apart(self.output, self.roots)
        replaces = any(os.path.realpath(target) == os.path.realpath(root) for root in self.roots)
        if self.in_place != replaces:
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


def _apart(output: str, roots: tuple[Path, ...]) -> Path:
    target = Path(output).expanduser().absolute()
    for root in roots:
        if root in target.parents or target in root.parents:
            raise HandrailError(f"--output {output}: expected a folder apart from {root}")
    return target
