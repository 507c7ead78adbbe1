"""A trained policy on disk: LeRobot's own checkpoint, and beside it what Handrail needs to let it drive.

    OUTPUT/checkpoints/<step>/pretrained_model/{config.json, model.safetensors, …, handrail.json}
    OUTPUT/checkpoints/<step>/training_state/…

A checkpoint appears under its name only when it is whole.
"""

import itertools
import json
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

from msgspec import Meta

from handrail.collect.config import FPS_RANGE, MOST_TIME
from handrail.controllers.errors import HandrailError, shown
from handrail.controllers.regular_file import is_inside
from handrail.controllers.typed import Count, Name, NonNegative, decoded
from handrail.datasets.storage.atomic import remove, sync, write_whole
from handrail.datasets.storage.strict_json import load_json
from handrail.policies.imitation.interface.interface import PolicyInterface
from handrail.policies.imitation.interface.trust import CONFIG

FORMAT = "handrail.policy/2"
NAME = "handrail.json"
MODEL = "pretrained_model"
MIXED = "mixed"
Fps = Annotated[int, Meta(ge=FPS_RANGE[0], le=FPS_RANGE[1])]
RobotName = Annotated[str, Meta(max_length=200, pattern=r"\A[\w+:,.\- ]*(?<!\.toml)\Z")]


@dataclass(frozen=True)
class TrainingSizes:
    """Sizes of a policy and of its training: a preset's, and over it what the settings say."""

    options: Mapping[str, Any] = field(default_factory=dict)
    """Of the policy, as LeRobot calls them."""
    lr: NonNegative = 1e-4
    """Highest learning rate."""
    cosine: bool = False
    """Whether the learning rate falls along a cosine; else as the policy has it."""
    steps: Count = 100_000
    """Updates."""
    batch_size: Count = 64
    """Samples an update."""


@dataclass(frozen=True)
class PolicyMeta:
    """The description of a policy and of its training."""

    interface: PolicyInterface | None
    """Its inputs and outputs; None if they are the recorded columns."""
    environment: Name
    """The task of its episodes; "" if they do not say."""
    mode: Name
    """Their teleop mode; "mixed" if there were several, "" if they do not say."""
    robot: RobotName
    """Their robot."""
    fps: Annotated[int, Meta(ge=1, le=1000)]
    """Decisions a second [Hz]."""
    actions: Literal["realised", "intent", "recorded"]
    training_seed: Count
    """Of the first weights and the order of samples."""
    dataset_draw: Count
    """Seed of the choice of episodes."""
    trained_on: Mapping[str, NonNegative]
    """`episodes`, `attempts`, `operator_time` [s]."""
    policy: Name
    """Its type in LeRobot."""
    steps: Count
    """Updates."""
    training: Mapping[str, Any] = field(default_factory=dict)
    """The settings of the training."""
    versions: Mapping[str, Any] = field(default_factory=dict)
    """Of the software."""
    sizes: TrainingSizes = field(default_factory=TrainingSizes)
    episodes: tuple[Count, ...] = ()
    """Numbers of its episodes, in order, those that were held out among them."""
    data: Name = ""
    """Digest of these."""
    time_limit: Annotated[float, Meta(ge=0, le=MOST_TIME)] = 0.0
    """That its episodes had at most [s]; 0 if that was the task's own, or they do not say."""
    cameras: Mapping[Name, tuple[Count, Count]] = field(default_factory=dict)
    """Height and width of the pictures that its encoder reads [px], by camera."""
    hand: Name = ""
    """Which of several hands does the task; "mixed" if several did, "" of one hand."""
    validation: Mapping[Annotated[str, Meta(pattern=r"\A[0-9]+\Z")], float] = field(default_factory=dict)
    """Loss on the episodes that were held out, by update."""
    task: str = ""
    """The one sentence that says what is done in its episodes; "" of several, or if they do not say."""

    @property
    def intent_mode(self) -> str:
        """Teleop mode whose intents it decides on; empty for joint velocities."""
        return self.mode if self.actions == "intent" else ""


def read_meta(folder: Path) -> PolicyMeta:
    """Return what `handrail.json` in a `pretrained_model` folder says."""
    path = folder / NAME
    content = load_json(path, "a policy of handrail-train")
    said = content.pop("format", None) if isinstance(content, dict) else content
    if said != FORMAT:
        raise HandrailError(f"{str(path)!r}: expected the format {FORMAT}, got {shown(said)}")
    meta = decoded(content, PolicyMeta, repr(str(path)))
    written = meta.interface.actions if meta.interface else "recorded"
    if meta.actions != written or (written == "intent" and not meta.mode):
        words = f"expected actions {written}, as its interface has, and a mode for an intent"
        raise HandrailError(f"{str(path)!r}: {words}; got {meta.actions} of mode {meta.mode!r}")
    return meta


def write_meta(folder: Path, meta: PolicyMeta) -> None:
    """Write `handrail.json` into a `pretrained_model` folder."""
    content = {"format": FORMAT} | asdict(meta)
    if not meta.hand:  # of robots with one hand the file is as it was
        del content["hand"]
    write_whole(folder / NAME, (json.dumps(content, indent=1, allow_nan=False) + "\n").encode())


def as_json(settings: Any) -> dict[str, Any]:
    """Return the fields of a dataclass as they come back from a file."""
    return json.loads(json.dumps(asdict(settings)))


def last_checkpoint(training: Path) -> Path | None:
    """Return the whole checkpoint with the most updates in a training's folder; None if there is none."""
    found = [path for path in (training / "checkpoints").glob("*") if path.name.isdecimal()]
    return max(found, key=lambda path: int(path.name), default=None)


def model_folder(folder: Path) -> Path:
    """Return the `pretrained_model` folder there, in a checkpoint, or in a training's last one."""
    last = last_checkpoint(folder)
    places = (folder, folder / MODEL, *([last / MODEL] if last else []))
    for name, place in itertools.product((NAME, CONFIG), places):
        if (place / name).is_file():
            if not is_inside(place, folder):
                raise HandrailError(f"{str(place)!r}: expected it in {str(folder)!r}, found a link out of it")
            return place
    raise HandrailError(f"policy {str(folder)!r}: expected a checkpoint with a {CONFIG}, found none")


def point_to(checkpoint: Path) -> None:
    """Let `checkpoints/last` lead to a checkpoint, at once."""
    link, fresh = checkpoint.parent / "last", checkpoint.parent / ".last"
    fresh.unlink(missing_ok=True)
    fresh.symlink_to(checkpoint.name)
    if link.is_dir() and not link.is_symlink():  # of a copy that followed links
        remove(link)
    os.replace(fresh, link)
    sync(checkpoint.parent)
