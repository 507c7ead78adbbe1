"""Settings of `handrail-edit`; light to import."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from handrail.controllers.errors import HandrailError
from handrail.datasets.lists import Words

Verb = Literal["delete", "keep", "split", "merge", "trim", "relabel", "rename"]
_NEEDED = {
    "delete": ("episodes",),
    "keep": ("episodes",),
    "split": ("parts", "output"),
    "merge": ("output",),
    "trim": (),
    "relabel": ("episodes", "label"),
    "rename": ("task",),
}
_TAKEN = {
    "delete": (),
    "keep": (),
    "split": (),
    "merge": (),
    "trim": ("episodes",),
    "relabel": ("reason",),
    "rename": ("episodes", "old_task"),
}
_SOME = ("episodes", "parts", "label", "reason", "task", "old_task")  # that only some verbs take


@dataclass(frozen=True)
class EditConfig:
    """Delete, keep, split, merge, trim or rename episodes that Handrail recorded; every column stays."""

    verb: tyro.conf.Positional[Verb]
    """delete or keep: --episodes. split: into --parts. merge: all folders into one. trim: cut off what is
    idle at both ends. relabel: say with --label how --episodes ended. rename: give the task --task."""
    folders: Annotated[tyro.conf.Positional[Words], tyro.conf.arg(metavar="FOLDER [FOLDER …]")]
    """Folder of the dataset; of several to merge."""
    output: str = ""
    """Folder of the new dataset; of split, the folder for the parts."""
    in_place: bool = False
    """Write the dataset anew in its own place, instead of --output; what is left out is gone."""
    episodes: Words = ()
    """Which episodes: 3, 0-4, failed, succeeded; trim and rename take all when empty."""
    parts: Words = ()
    """The parts of split: NAME=SHARE, such as train=0.8 test=0.2; or NAME=EPISODES, such as test=3,5-7."""
    label: Literal["", "success", "failure"] = ""
    """How the episodes of relabel ended."""
    reason: str = ""
    """Why they failed, in words."""
    task: str = ""
    """The sentence that rename gives a task."""
    old_task: str = ""
    """The sentence that it replaces; all of them when empty."""
    margin: float = 0.25
    """Time that trim leaves before the first motion and after the last [s]."""
    name: str = ""
    """Name of the new dataset, owner/name; that of the first folder when empty."""
    verify: bool = False
    """Read every file of the datasets anew, not only those that have changed since they were checked."""

    @property
    def roots(self) -> tuple[Path, ...]:
        """The folders of the datasets."""
        return tuple(Path(folder).expanduser().absolute() for folder in self.folders)

    @property
    def target(self) -> Path:
        """The folder of what is written."""
        return Path(self.output).expanduser().absolute() if self.output else self.roots[0]

    def check(self) -> None:
        """Check what can be checked without reading anything."""
        self._check_folders()
        for name in _NEEDED[self.verb]:
            if not getattr(self, name):
                raise HandrailError(f"{self.verb}: expected --{name}, got none")
        for name in _SOME:
            if getattr(self, name) and name not in (*_NEEDED[self.verb], *_TAKEN[self.verb]):
                raise HandrailError(f"--{name}: expected it not with {self.verb}, got both")
        if self.reason and self.label != "failure":
            raise HandrailError("--reason: expected it with --label failure")
        if not (math.isfinite(self.margin) and self.margin >= 0.0):
            raise HandrailError(f"--margin {self.margin}: expected a time of 0 or more [s]")

    def _check_folders(self) -> None:
        count, several = len(self.folders), self.verb == "merge"
        if count < 2 if several else count != 1:
            what = "two folders or more" if several else "one folder"
            raise HandrailError(f"{self.verb}: expected {what}, got {count}")
        if self.in_place and self.verb in ("split", "merge"):
            raise HandrailError(f"--in_place: expected --output with {self.verb}")
        if bool(self.output) == self.in_place:
            got = "both" if self.in_place else "neither"
            raise HandrailError(
                f"{self.verb}: expected --output FOLDER for a new dataset, or --in_place; got {got}"
            )
        for root in self.roots if self.output else ():
            if self.target == root or root in self.target.parents or self.target in root.parents:
                raise HandrailError(f"--output {self.output}: expected a folder apart from {root}")
