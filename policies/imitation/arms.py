"""What is evaluated: a checkpoint under a condition, which together are an arm."""

import hashlib
import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from handrail.collect.config import TASKS
from handrail.collect.operators.modes import find_mode
from handrail.collect.perturbations import Perturbation
from handrail.controllers.errors import HandrailError
from handrail.datasets.strict_json import read_json
from handrail.policies.imitation.checkpoint import PolicyMeta, model_folder, read_meta
from handrail.policies.imitation.evaluate_config import EvaluateConfig
from handrail.policies.imitation.interface import PolicyInterface

UNPROTECTED = ("direct", "split")  # completions of modes that keep nothing but the joints' limits
_IMAGES = "observation.images."


@dataclass(frozen=True)
class Checkpoint:
    """A trained policy on the disk.

    Attributes:
        folder: its files.
        meta: what it says of itself.
        interface: what it reads and writes; None if that is what was recorded.
        pictures: height and width of what it sees, by camera [px].
        digest: of all its files.
    """

    folder: Path
    meta: PolicyMeta
    interface: PolicyInterface | None
    pictures: Mapping[str, tuple[int, int]]
    digest: str

    @property
    def intent_mode(self) -> str:
        """Teleop mode whose intents it decides on; empty for joint velocities."""
        return self.meta.mode if self.meta.actions == "intent" else ""

    @property
    def movers(self) -> int:
        """How many moving obstacles it knows of."""
        names = self.interface.environment_names if self.interface else ()
        return len({name.split(".")[0] for name in names if name.startswith("mover_")})

    @property
    def key(self) -> tuple[int, int]:
        """Draw of the dataset and training seed."""
        return self.meta.dataset_draw, self.meta.training_seed


@dataclass(frozen=True)
class Arm:
    """A checkpoint under a condition.

    Attributes:
        checkpoint: which policy.
        protection: what stands between it and the robot: `none`, `mpc`, `filter`, or a mode's `cbf`.
        perturbation: what disturbs.
        time_limit: after which a rollout is given up [s]; the task's own when 0.
        label: what it is called.
    """

    checkpoint: Checkpoint
    protection: str
    perturbation: Perturbation
    time_limit: float
    label: str

    @property
    def conditions(self) -> dict[str, str]:
        """What all rollouts of this label have in common."""
        meta = self.checkpoint.meta
        return {
            **{name: str(getattr(meta, name)) for name in ("environment", "robot", "mode", "fps", "actions")},
            "protection": self.protection,
            "perturbation": self.perturbation.text,
            "time_limit": f"{self.time_limit:g}",
        }


def read_checkpoint(folder: Path) -> Checkpoint:
    """Return the checkpoint in a folder, or the last one of a training run's folder.

    Raises:
        HandrailError: there is none, or none of Handrail's.
    """
    place = model_folder(folder)
    interface, meta = read_meta(place)
    if meta.environment not in TASKS:
        raise HandrailError(
            f"--policy {place}: expected one trained for one of {', '.join(TASKS)}, got {meta.environment!r}"
        )
    return Checkpoint(place, meta, interface, _pictures(place), _digest(place))


def _pictures(place: Path) -> dict[str, tuple[int, int]]:
    """Return what a policy sees, from LeRobot's own settings."""
    path = place / "config.json"
    try:
        features = read_json(path).get("input_features") or {}
        shapes = {name: feature["shape"] for name, feature in features.items() if name.startswith(_IMAGES)}
        return {name.removeprefix(_IMAGES): (int(h), int(w)) for name, (_, h, w) in shapes.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise HandrailError(f"{str(path)!r}: expected a policy of LeRobot, got {error!r}") from error


def arms(config: EvaluateConfig) -> tuple[Arm, ...]:
    """Return every checkpoint under every condition of the settings.

    Raises:
        HandrailError: a checkpoint is none, a protection does not fit it, or two of them are one and the same
            policy of an arm.
    """
    checkpoints = [read_checkpoint(folder) for folder in config.folders]
    environments = {checkpoint.meta.environment for checkpoint in checkpoints}
    if len(environments) > 1:
        raise HandrailError(
            f"--policy: expected policies for one task, got {', '.join(sorted(environments))}"
        )
    conditions = itertools.product(config.perturbations, config.protections, checkpoints)
    found: dict[tuple[str, tuple[int, int]], Arm] = {}
    for perturbation, protection, checkpoint in conditions:
        arm = _arm(checkpoint, protection, perturbation, config)
        before = found.setdefault((arm.label, checkpoint.key), arm)
        if before != arm:
            raise HandrailError(
                f"--policy {checkpoint.folder}: expected each dataset draw and training seed once, but arm "
                f"{arm.label!r} has {checkpoint.key} already, {before.checkpoint.folder}; give it a --label"
            )
    return tuple(found.values())


def _arm(checkpoint: Checkpoint, protection: str, perturbation: Perturbation, config: EvaluateConfig) -> Arm:
    own = _own(checkpoint)
    chosen = own if protection == "own" else protection
    if chosen in ("mpc", "filter") and chosen != own and not _fits(checkpoint, chosen):
        raise HandrailError(
            f"--protection {protection}: expected a policy that commands every joint, or own or none; "
            f"{checkpoint.folder} decides on the intent of mode {checkpoint.meta.mode}"
        )
    words = [config.label or _name(checkpoint), _protected(chosen, own), perturbation.words]
    return Arm(checkpoint, chosen, perturbation, config.time_limit, " ".join(filter(None, words)))


def _own(checkpoint: Checkpoint) -> str:
    """Return the protection that a policy's actions have by themselves."""
    if not checkpoint.intent_mode:
        return "none"
    completion = find_mode(checkpoint.intent_mode).controller
    return "none" if completion in UNPROTECTED else completion


def _fits(checkpoint: Checkpoint, protection: str) -> bool:
    """Return whether a controller can stand in for a policy's own.

    The filter completes nothing, so it needs every joint; so does the MPC where joints that nobody commands
    are meant to rest.
    """
    if not checkpoint.intent_mode:
        return True
    completes = find_mode(checkpoint.intent_mode).controller != "direct"
    return (protection == "mpc" and completes) or _commands_joints(checkpoint.interface)


def _commands_joints(interface: PolicyInterface | None) -> bool:
    """Return whether every mask leaves nothing over: all joints, or the base's twist and the arm's joints."""
    if interface is None:
        return True
    names, masks = interface.channels, np.array(interface.masks, bool)  # (k, m)
    base, joint = (np.array([name.startswith(group) for name in names]) for group in ("base.", "joint."))
    joints = masks[:, joint]  # (k, n), the base's first
    driven = masks[:, base].all(axis=1) & joints[:, base.sum() :].all(axis=1) & base.any()
    return bool(np.all(joints.all(axis=1) | driven))


def _name(checkpoint: Checkpoint) -> str:
    return checkpoint.meta.mode + (" intent" if checkpoint.intent_mode else "")


def _protected(chosen: str, own: str) -> str:
    if chosen == own:
        return ""
    return "unprotected" if chosen == "none" else chosen


def _digest(folder: Path) -> str:
    """Return a short digest of a folder's files."""
    digest = hashlib.sha256()
    for path in sorted(folder.iterdir()):
        if path.is_file():
            digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:16]
