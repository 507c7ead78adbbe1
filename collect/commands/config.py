"""The settings of the commands that look at datasets."""

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro

from handrail.collect.config import SessionConfig, StoredConfig
from handrail.collect.execution.config import ExecutionConfig
from handrail.collect.flags import check_file
from handrail.controllers.errors import HandrailError
from handrail.datasets.advanced import Advanced
from handrail.datasets.editing.config import EditConfig
from handrail.datasets.lists import Names


@dataclass(frozen=True, kw_only=True)
class TrustConfig:
    """Names that a dataset may use because the command line does."""

    task: Advanced[str] = ""
    """The recorded task where it is a module:name: a dataset alone does not make Handrail import it."""
    mode: Advanced[str] = ""
    """The same of the teleop mode."""
    operator: Advanced[str] = ""
    """The same of the operator."""
    robot: Advanced[str] = ""
    """The same of the robot; or its description file (.toml), where that is not where it was."""

    @property
    def said(self) -> tuple[str, ...]:
        """The names."""
        return (self.task, self.mode, self.operator, self.robot)


@dataclass(frozen=True)
class ReplayConfig(TrustConfig):
    """Run a recorded episode's commands in its environment and report the deviation."""

    dataset: StoredConfig = field(default_factory=StoredConfig)
    episode: int = -1
    """Which episode; all of them when negative."""
    video: str = ""
    """Also film the episode to this .mp4 file (needs OpenGL)."""

    def check(self) -> None:
        """Check the settings."""
        check_file("--video", self.video, ".mp4")
        if self.video and self.episode < 0:
            raise HandrailError("--video: expected --episode with the number of one episode")


@dataclass(frozen=True, kw_only=True)
class RenderConfig(EditConfig, ExecutionConfig, TrustConfig):
    """Write a dataset with pictures of its episodes, drawn while their commands run again.

    A second run goes on with a first.
    """

    verb = "render"
    needed = ("output", "cameras")
    cameras: Names = ""
    """Cameras of the robot, such as front,wrist; scene overlooks it; or all."""
    image_size: int | str = SessionConfig.image_size
    """Size of the pictures [pixels]: of a square's side, or WIDTHxHEIGHT."""
    randomise: bool = False
    """Draw light, colours, textures, cameras anew in each episode, even if none of it was when recorded."""

    @property
    def seen(self) -> dict[str, Any]:
        """Settings of a session that say what is drawn."""
        said = {"cameras": self.cameras, "image_size": self.image_size}
        return said | ({"randomise": True} if self.randomise else {})

    def check(self) -> None:
        """Check what can be checked without reading anything."""
        if self.in_place:
            raise HandrailError("--in_place: expected --output with render")
        super().check()
        self.check_execution()


@dataclass(frozen=True)
class RepairConfig:
    """Say what is wrong with a dataset, and mend it.

    Exit code 0 only if everything that was saved is in the dataset and whole, else 1.
    """

    dataset: StoredConfig = field(default_factory=StoredConfig)
    set_aside: bool = False
    """Keep episodes that cannot be mended in .damaged; those after them move up. Without, they stay."""


@dataclass(frozen=True)
class InspectConfig:
    """Print the episodes of a LeRobot dataset as a table."""

    dataset: StoredConfig = field(default_factory=StoredConfig)
    check: bool = False
    """Read every byte and compare it with the checksums; exit code 1 if anything is not as it was saved."""
    quality: bool = False
    """Also print how smooth the motion was and how much the commands chattered."""
    worst: str = ""
    """Print the worst episodes by this quality metric instead, and the command that leaves them out."""
    count: int = 5
    """How many of the worst."""


@dataclass(frozen=True)
class PushConfig:
    """Write a dataset's card and say what would be sent to the Hugging Face hub; --upload sends it."""

    dataset: StoredConfig = field(default_factory=StoredConfig)
    upload: bool = False
    """Send it, with LeRobot's upload, as --dataset.repo_id; log in first (hf auth login)."""
    to: str = ""
    """Send it to this place instead of the hub: s3://bucket/folder, gs://…, or what else fsspec knows."""
    private: bool = True
    """Whether only you see it there."""
    license: str = "cc-by-4.0"
    """Its licence, as the hub writes it: cc-by-4.0, cc0-1.0, apache-2.0, …"""
    verify: bool = False
    """Read every file anew, not only those that have changed since they were checked."""

    def check(self) -> None:
        """Check the settings."""
        if not re.fullmatch(r"[\w-][\w.-]*/[\w-][\w.-]*", self.dataset.repo_id):
            got = self.dataset.repo_id or "none"
            raise HandrailError(f"--dataset.repo_id: expected its name on the hub, owner/name; got {got}")
        if not re.fullmatch(r"[a-z0-9][a-z0-9.-]*", self.license):
            raise HandrailError(f"--license: expected a name such as cc-by-4.0, got {self.license!r}")
        if self.to and not re.fullmatch(r"[a-z0-9+.-]+://[^\s]+", self.to):
            raise HandrailError(f"--to: expected an address such as s3://bucket/folder, got {self.to!r}")


@dataclass(frozen=True)
class DemoConfig:
    """Record a few real demonstrations and show what came out."""

    episodes: int = 5
    """How many."""
    overwrite: bool = False
    """Remove an earlier demo's dataset."""
    place: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="FOLDER")] = ""
    """Folder for the dataset and the picture; outputs/demo when none is given."""

    @property
    def folder(self) -> Path:
        """The folder of the demo."""
        return Path(self.place or "outputs/demo").expanduser()
