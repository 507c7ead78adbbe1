"""What is evaluated: a checkpoint under a condition."""

import hashlib
import itertools
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from handrail.collect.operators.modes import MODES
from handrail.collect.session.perturbations import Perturbation
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.baselines.catalogue import CONTROLLERS
from handrail.controllers.entries import is_count
from handrail.controllers.errors import HandrailError
from handrail.controllers.regular_file import open_regular
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.datasets.storage.strict_json import load_json, read_json
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.evaluation.features import pictures, place_of
from handrail.policies.imitation.interface.checkpoint import NAME, PolicyMeta, model_folder, read_meta
from handrail.policies.imitation.interface.interface import PolicyInterface
from handrail.policies.imitation.interface.trust import check_policy_folder

_TRAINED = "train_config.json"  # of LeRobot's: how a policy was trained, not how it drives


@dataclass(frozen=True)
class Checkpoint:
    """A trained policy on the disk.

    Attributes:
        folder: its files.
        meta: what it says of itself.
        interface: what it reads and writes; None if that is what was recorded.
        pictures: height and width of what it sees, by camera [px].
        movers: how many moving obstacles it knows of.
        joined: whether it reads robot and scene as one vector.
        digest: of all that decides how it drives; not of where and when it was trained.
    """

    folder: Path
    meta: PolicyMeta
    interface: PolicyInterface | None
    pictures: Mapping[str, tuple[int, int]]
    movers: int
    joined: bool
    digest: str

    @property
    def intent_mode(self) -> str:
        """Teleop mode whose intents it decides on; empty for joint velocities."""
        return self.meta.mode if self.meta.actions == "intent" else ""

    @property
    def key(self) -> tuple[int, int]:
        """Draw of the dataset and training seed."""
        return self.meta.dataset_draw, self.meta.training_seed


@dataclass(frozen=True)
class PolicyCondition:
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


def read_checkpoint(folder: Path, config: EvaluateConfig) -> Checkpoint:
    """Return the checkpoint in a folder, or the last one of a training run's folder.

    Args:
        folder: of the checkpoint.
        config: says what plain LeRobot's do not, their rate and perhaps their task.
    """
    place = model_folder(folder)
    settings = check_policy_folder(place)
    where = f"--policy {place}"
    interface, meta = (
        read_meta(place) if (place / NAME).is_file() else (None, _plain(place, settings, config))
    )
    if config.task and meta.environment in TASKS and meta.environment != config.task:
        raise HandrailError(f"{where}: expected one trained for {config.task}, got {meta.environment!r}")
    TASKS.admit(meta.environment, (config.task,))  # before anything that a policy names is imported
    MODES.admit(meta.mode, (config.mode,))
    ROBOTS.admit(meta.robot, (config.robot,))
    if interface is not None:
        if not TASKS.accepts(meta.environment):
            raise HandrailError(
                f"{where}: expected one trained for one of {', '.join(TASKS)}, got {meta.environment!r}"
            )
        movers = len({n.split(".")[0] for n in interface.environment_names if n.startswith("mover_")})
        joined = False
    else:
        robot = meta.robot if meta.robot in ROBOTS else config.robot
        task = meta.environment if meta.environment in TASKS else config.task
        known = place_of(settings, where, robot, task, meta.mode if meta.actions == "intent" else "")
        meta, movers = replace(meta, environment=known.task, robot=known.robot), known.movers
        joined = known.joined
    return Checkpoint(place, meta, interface, pictures(settings, where), movers, joined, _digest(place))


def _plain(place: Path, settings: Mapping[str, Any], config: EvaluateConfig) -> PolicyMeta:
    """Return what is known of a policy of plain `lerobot-train`."""
    path = place / _TRAINED
    training = load_json(path, "settings of LeRobot") if path.is_file() else {}
    seed = training.get("seed") if isinstance(training, dict) else None
    step = place.parent.name
    return PolicyMeta(
        environment="",
        mode=config.mode,
        robot="",
        fps=config.fps,
        actions="intent" if config.mode else "recorded",
        training_seed=seed if is_count(seed) else 0,
        dataset_draw=0,
        trained_on={},
        policy=settings["type"],
        steps=int(step) if step.isdecimal() else 0,
    )


def policy_conditions(config: EvaluateConfig) -> tuple[list[PolicyCondition], list[str]]:
    """Return every checkpoint under every condition of the settings, and why some cannot be."""
    refused: list[str] = []
    checkpoints = [
        each
        for folder in config.folders
        if (each := _tried(refused, lambda f=folder: read_checkpoint(f, config)))
    ]
    environments = {checkpoint.meta.environment for checkpoint in checkpoints}
    if len(environments) > 1:
        raise HandrailError(
            f"--policy: expected policies for one task, got {', '.join(sorted(environments))}"
        )
    found: dict[tuple[str, tuple[int, int]], PolicyCondition] = {}
    for settings in itertools.product(config.perturbations, config.protections, checkpoints):
        condition = _tried(refused, lambda s=settings: _condition(*s, config))
        if condition is None:
            continue
        checkpoint = condition.checkpoint
        before = found.setdefault((condition.label, checkpoint.key), condition)
        if before != condition:
            raise HandrailError(
                f"--policy {checkpoint.folder}: expected each dataset draw and training seed once, but"
                f" condition {condition.label!r} has {checkpoint.key} already, {before.checkpoint.folder};"
                " give it a --label"
            )
    refused = list(dict.fromkeys(refused))
    if not found:
        raise HandrailError("; ".join(refused))
    return list(found.values()), refused


def _tried[Value](refused: list[str], make: Callable[[], Value]) -> Value | None:
    try:
        return make()
    except HandrailError as error:
        refused.append(str(error))
        return None


def _condition(
    perturbation: Perturbation, protection: str, checkpoint: Checkpoint, config: EvaluateConfig
) -> PolicyCondition:
    meta, own = checkpoint.meta, own_protection(checkpoint.intent_mode)
    chosen = own if protection == "own" else protection
    if checkpoint.intent_mode and chosen not in (own, "none"):
        raise HandrailError(
            f"--protection {protection}: expected a policy of joint velocities, or own or none; "
            f"{checkpoint.folder} decides on the intent of mode {meta.mode}"
        )
    written = meta.actions if checkpoint.intent_mode else ""
    name = " ".join(filter(None, (meta.mode or meta.policy, written)))
    protected = "" if chosen == own else "unprotected" if chosen == "none" else chosen
    label = " ".join(filter(None, (config.label or name, protected, perturbation.words)))
    limit = config.time_limit or meta.time_limit
    return PolicyCondition(checkpoint, chosen, perturbation, limit, label)


def own_protection(mode: str) -> str:
    """Return the protection that a policy's actions have by themselves: intents of a mode, or none of any."""
    if not mode:
        return "none"
    spec = CONTROLLERS.find(MODES.find(mode).controller)
    return spec.name if spec.protects else "none"


def _digest(folder: Path) -> str:
    digest = hashlib.sha256()
    for path in sorted(folder.iterdir()):
        if path.is_file() and path.name != _TRAINED:
            digest.update(path.name.encode())
            if path.name == NAME:
                digest.update(_without_training(path))
                continue
            with open_regular(path) as file:
                hashlib.file_digest(file, lambda: digest)  # adds the file to it
    return digest.hexdigest()[:16]


def _without_training(path: Path) -> bytes:
    return json.dumps({key: value for key, value in read_json(path).items() if key != "training"}).encode()
