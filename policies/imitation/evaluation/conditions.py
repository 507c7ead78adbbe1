"""What is evaluated: a checkpoint under a condition."""

import hashlib
import itertools
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypedDict

from handrail.collect.operators.modes import MODES
from handrail.collect.session.perturbations import Perturbation
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.baselines.catalogue import CONTROLLERS
from handrail.controllers.errors import HandrailError
from handrail.controllers.regular_file import open_regular
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.typed import Count, check
from handrail.datasets.reading.reader import read_episodes, read_info
from handrail.datasets.storage.strict_json import load_json, read_json
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.evaluation.features import movers_of, pictures
from handrail.policies.imitation.interface.checkpoint import (
    NAME,
    PolicyMeta,
    model_folder,
    origin_of,
    read_meta,
)
from handrail.policies.imitation.interface.interface import PolicyInterface
from handrail.policies.imitation.interface.trust import check_policy_folder

_TRAINED = "train_config.json"  # of LeRobot's: how a policy was trained, not how it drives


class _Dataset(TypedDict, total=False):
    root: str | None


class _Trained(TypedDict, total=False):
    seed: Count | None
    dataset: _Dataset | None


@dataclass(frozen=True)
class Checkpoint:
    """A trained policy on the disk."""

    folder: Path
    meta: PolicyMeta
    interface: PolicyInterface | None
    """What it reads and writes; None if that is what was recorded."""
    pictures: Mapping[str, tuple[int, int]]
    """Height and width of what it sees, by camera [px]."""
    movers: int
    """Number of moving obstacles that it knows of."""
    joined: bool
    """Whether it reads robot and scene as one vector."""
    digest: str
    """Of all that decides how it drives; not of where and when it was trained."""

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
        movers = len({n.split(".")[0] for n in interface.environment_names if n.startswith("mover_")})
        joined = False
    else:
        robot = meta.robot if meta.robot in ROBOTS else config.robot
        task = meta.environment if meta.environment in TASKS else config.task
        if not (robot and task):
            raise HandrailError(f"{where}: expected --robot and --task: neither it nor its dataset says them")
        meta = replace(meta, environment=task, robot=robot)
        mode = meta.mode if meta.actions == "intent" else ""
        movers, joined = movers_of(settings, where, robot, task, mode)
    if not TASKS.accepts(meta.environment):
        raise HandrailError(
            f"{where}: expected one trained for one of {', '.join(TASKS)}, got {meta.environment!r}"
        )
    return Checkpoint(place, meta, interface, pictures(settings, where), movers, joined, _digest(place))


def _plain(place: Path, settings: Mapping[str, Any], config: EvaluateConfig) -> PolicyMeta:
    """Return what is known of a policy of plain `lerobot-train`: from its training and its dataset."""
    path, step = place / _TRAINED, place.parent.name
    content = load_json(path, "settings of LeRobot") if path.is_file() else {}
    training = check(content, _Trained, repr(str(path)))
    root, task, robot = Path((training.get("dataset") or {}).get("root") or place), "", ""
    with suppress(HandrailError, OSError):  # it need not be here
        task, _, robot = origin_of(read_info(root), read_episodes(root))
    return PolicyMeta(
        environment=task,
        mode=config.mode,
        robot=robot,
        fps=config.fps,
        actions="intent" if config.mode else "recorded",
        training_seed=training.get("seed") or 0,
        dataset_draw=0,
        trained_on={},
        policy=settings["type"],
        steps=int(step) if step.isdecimal() else 0,
    )


def policy_conditions(config: EvaluateConfig) -> tuple[list[PolicyCondition], list[str]]:
    """Return every checkpoint under every condition of the settings, and why some cannot be."""
    refused: list[str] = []
    checkpoints, found = [], dict[tuple[str, tuple[int, int]], PolicyCondition]()
    for folder in config.folders:
        with _noted(refused):
            checkpoints.append(read_checkpoint(folder, config))
    environments = {checkpoint.meta.environment for checkpoint in checkpoints}
    if len(environments) > 1:
        raise HandrailError(
            f"--policy: expected policies for one task, got {', '.join(sorted(environments))}"
        )
    for settings in itertools.product(config.perturbations, config.protections, checkpoints):
        condition = None
        with _noted(refused):
            condition = _condition(*settings, config)
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


@contextmanager
def _noted(refused: list[str]) -> Iterator[None]:
    try:
        yield
    except HandrailError as error:
        refused.append(str(error))


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
                kept = {key: value for key, value in read_json(path).items() if key != "training"}
                digest.update(json.dumps(kept).encode())
                continue
            with open_regular(path) as file:
                hashlib.file_digest(file, lambda: digest)  # adds the file to it
    return digest.hexdigest()[:16]
