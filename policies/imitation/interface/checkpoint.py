"""A trained policy on disk: LeRobot's own checkpoint, and beside it what Handrail needs to let it drive.

    OUTPUT/checkpoints/<step>/pretrained_model/{config.json, model.safetensors, …, handrail.json}
    OUTPUT/checkpoints/<step>/training_state/…

A checkpoint appears under its name only when it is whole.
"""

import itertools
import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from handrail.collect.config import FPS_RANGE, MOST_TIME
from handrail.controllers.arrays import FloatArray
from handrail.controllers.entries import Entry, is_count, is_name, is_number, is_table
from handrail.controllers.errors import HandrailError, message_of
from handrail.controllers.fields import check_fields
from handrail.controllers.regular_file import is_inside
from handrail.datasets.storage.atomic import sync_folder, write_whole
from handrail.datasets.storage.strict_json import load_json
from handrail.policies.imitation.config import ACTION_SPACES
from handrail.policies.imitation.interface.interface import ENVIRONMENT, STATE, PolicyInterface
from handrail.policies.imitation.interface.trust import CONFIG, check_policy_folder, registered_policies

FORMAT = "handrail.policy/2"
NAME = "handrail.json"
MODEL = "pretrained_model"
_LOW, _HIGH = FPS_RANGE
_CHECKED = {  # what more has to hold of `PolicyMeta` than the types of its fields say
    "robot": Entry("the name of a robot", lambda value: is_name(value) and not value.endswith(".toml")),
    "fps": Entry(
        f"a whole number from {_LOW} to {_HIGH}", lambda value: is_count(value) and _LOW <= value <= _HIGH
    ),
    "actions": Entry(f"one of {', '.join(ACTION_SPACES)}", lambda value: value in ACTION_SPACES),
    "time_limit": Entry(
        f"0 to {MOST_TIME:g} s", lambda value: is_number(value) and 0 <= value <= MOST_TIME, needed=False
    ),
    "sizes": Entry("settings by name", lambda value: _are_sizes(value), needed=False),
    "validation": Entry("losses by update", lambda value: _are_losses(value), needed=False),
}


@dataclass(frozen=True)
class PolicyMeta:
    """What a policy is and how it came about.

    Attributes:
        environment: the task of its episodes; "" if they do not say.
        mode: their teleop mode; "mixed" if there were several, "" if they do not say.
        robot: their robot.
        fps: decisions a second [Hz].
        actions: one of `ACTION_SPACES`.
        training_seed: of the first weights and the order of samples.
        dataset_draw: seed of the choice of episodes.
        trained_on: `episodes`, `attempts`, `operator_time` [s].
        policy: its type in LeRobot.
        steps: updates.
        training: the settings of the training.
        versions: of the software.
        sizes: what the training really used where its settings say 0, a preset's (`Preset`).
        episodes: numbers of the episodes that it learnt from, in order.
        data: digest of what it learnt from.
        time_limit: that its episodes had at most [s]; 0 if that was the task's own, or they do not say.
        validation: loss on the episodes that were held out, by update.
    """

    environment: str
    mode: str
    robot: str
    fps: int
    actions: str
    training_seed: int
    dataset_draw: int
    trained_on: Mapping[str, float]
    policy: str
    steps: int
    training: Mapping[str, Any] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)
    sizes: Mapping[str, Any] = field(default_factory=dict)
    episodes: Sequence[int] = ()
    data: str = ""
    time_limit: float = 0.0
    validation: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class TrainedPolicy:
    """A policy that can drive.

    Attributes:
        interface: what it reads and writes; None if that is what was recorded.
        meta: what it is; None of a policy of plain LeRobot.
        policy: LeRobot's policy.
        before: LeRobot's preprocessor: normalises.
        after: LeRobot's postprocessor: the reverse.
    """

    interface: PolicyInterface | None
    meta: PolicyMeta | None
    policy: Any
    before: Callable[[dict[str, Any]], dict[str, Any]]
    after: Callable[[Any], Any]

    def reset(self) -> None:
        """Forget the last episode."""
        self.policy.reset()

    def act(
        self,
        state: FloatArray,
        environment: FloatArray | None = None,
        images: Mapping[str, np.ndarray] | None = None,
        task: str = "",
    ) -> FloatArray:
        """Return the next action, (a,) float32.

        Args:
            state: as the interface observes it, (s',).
            environment: the same, (e',); None or empty if there is none.
            images: pictures by camera, (height, width, 3) uint8 each.
            task: one sentence: what to do; for policies that read it.
        """
        import torch

        batch: dict[str, Any] = {
            key: torch.from_numpy(np.asarray(values, np.float32))[None]
            for key, values in zip((STATE, ENVIRONMENT), (state, environment), strict=True)
            if key in self.policy.config.input_features and values is not None and np.size(values)
        }
        for camera, picture in (images or {}).items():
            pixels = torch.from_numpy(np.ascontiguousarray(picture)).permute(2, 0, 1)
            batch[f"observation.images.{camera}"] = pixels[None].float() / 255.0
        batch["task"] = [task]
        try:
            with torch.inference_mode():
                return self.after(self.policy.select_action(self.before(batch)))[0].cpu().numpy()
        except Exception as error:  # of LeRobot and all below it
            raise HandrailError(
                f"policy {self.policy.config.type}: cannot act: {message_of(error)}"
            ) from error


def load_policy(folder: str | Path, device: str = "cpu") -> TrainedPolicy:
    """Load a policy from a `pretrained_model` folder, a checkpoint, or a training's folder (the last one).

    Whoever made it, loading it runs no code of theirs (`trust.py`).
    """
    place = model_folder(Path(folder).expanduser())
    interface, meta = read_meta(place) if (place / NAME).is_file() else (None, None)
    settings = check_policy_folder(place)
    import draccus
    from lerobot.policies.factory import get_policy_class, make_pre_post_processors

    from handrail.policies.imitation.interface.numbers import check_statistics, check_weights
    from handrail.policies.imitation.interface.steps import without_steps

    kind, override = settings.pop("type"), {"device_processor": {"device": device}}
    try:
        config = draccus.decode(registered_policies()[kind], settings | {"device": device})
        policy = get_policy_class(kind).from_pretrained(place, config=config, strict=True)
        around = make_pre_post_processors(config, str(place), preprocessor_overrides=override)
    except Exception as error:  # of LeRobot and all below it: whatever the files hold, they are refused
        raise HandrailError(f"policy {str(place)!r}: {message_of(error)}") from error
    check_weights(policy, place)
    for pipeline in around:
        check_statistics(pipeline, place)
    interface = _interface_of(around[0], interface, place)
    before, after = map(without_steps, around)  # an operator sees and acts through the interface itself
    policy.eval()
    policy.eval = lambda: policy  # LeRobot asks for it twice an action: a third of its time
    return TrainedPolicy(interface, meta, policy, before, after)


def _interface_of(before: Any, said: PolicyInterface | None, place: Path) -> PolicyInterface | None:
    """Return the interface of a checkpoint: as its notes say, or its steps."""
    from handrail.policies.imitation.interface.steps import interface_in

    stepped = interface_in(before)
    if stepped is not None and said not in (None, stepped):
        raise HandrailError(f"policy {str(place)!r}: expected {NAME} and the steps to agree on the interface")
    return said or stepped


def read_meta(folder: Path) -> tuple[PolicyInterface | None, PolicyMeta]:
    """Return what `handrail.json` in a `pretrained_model` folder says."""
    path = folder / NAME
    content = load_json(path, "a policy of handrail-train")
    if not isinstance(content, dict) or content.get("format") != FORMAT or "interface" not in content:
        known = content.get("format") if isinstance(content, dict) else content
        raise HandrailError(f"{str(path)!r}: expected the format {FORMAT}, got {known!r:.80}")
    del content["format"]
    interface = content.pop("interface")
    check_fields(content, PolicyMeta, repr(str(path)), **_CHECKED)
    meta = PolicyMeta(**content)
    described = None if interface is None else PolicyInterface.from_dict(interface)
    written = "recorded" if described is None else described.actions
    if meta.actions != written or (written == "intent" and not meta.mode):
        raise HandrailError(
            f"{str(path)!r}: expected actions {written}, as its interface has them, and a mode for an intent;"
            f" got {meta.actions} of mode {meta.mode!r}"
        )
    return described, meta


def _are_losses(value: Any) -> bool:
    return is_table(value) and all(step.isdecimal() and is_number(loss) for step, loss in value.items())


def _are_sizes(value: Any) -> bool:
    return is_table(value) and is_count(value.get("steps", 0)) and is_table(value.get("options", {}))


def write_meta(folder: Path, interface: PolicyInterface | None, meta: PolicyMeta) -> None:
    """Write `handrail.json` into a `pretrained_model` folder."""
    described = None if interface is None else asdict(interface)
    content = {"format": FORMAT, "interface": described} | asdict(meta)
    write_whole(folder / NAME, (json.dumps(content, indent=1, allow_nan=False) + "\n").encode())


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
    os.replace(fresh, link)
    sync_folder(checkpoint.parent)
