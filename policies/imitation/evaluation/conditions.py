"""The evaluated arms: a checkpoint, its robot and task (from it, its dataset or flags), and a condition."""

import hashlib
import itertools
import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypedDict

from handrail.collect.config import MOST_MOVING, SessionConfig
from handrail.collect.lerobot.mode_action import ModeAction
from handrail.collect.operators.modes import MODES
from handrail.collect.session.build import build_mode, build_task
from handrail.collect.session.perturbations import PICTURES, Perturbation
from handrail.collect.world.observation import AgentObservation
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.baselines.catalogue import CONTROLLERS
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.regular_file import open_regular
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.robot.description import load_description
from handrail.controllers.robot.model import load_model
from handrail.controllers.typed import Count, check
from handrail.datasets.reading.reader import read_episodes, read_info
from handrail.datasets.recording.frames import PICTURE
from handrail.datasets.storage.strict_json import load_json, read_json
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.interface.checkpoint import MIXED, NAME, PolicyMeta, model_folder, read_meta
from handrail.policies.imitation.interface.interface import ACTION, ENVIRONMENT, STATE
from handrail.policies.imitation.interface.origin import origin_of
from handrail.policies.imitation.interface.trust import check_policy_folder

_TRAINED = "train_config.json"  # of LeRobot's: how a policy was trained, not how it drives
_SAID = ("environment", "robot", "mode", "fps", "actions")


class _Trained(TypedDict, total=False):
    seed: Count | None
    dataset: Mapping[str, Any] | None


class _Shaped(TypedDict):
    shape: tuple[Count, ...]


@dataclass(frozen=True)
class Checkpoint:
    """A trained policy on the disk."""

    folder: Path
    meta: PolicyMeta
    pictures: Mapping[str, tuple[int, int]]
    """Height and width of what it sees, by camera [px]."""
    movers: int
    """Number of moving obstacles that it knows of."""
    joined: bool
    """Whether it reads robot and scene as one vector."""
    digest: str
    """Of all that decides how it drives; not of where and when it was trained."""

    @property
    def key(self) -> tuple[int, int]:
        """Draw of the dataset and training seed."""
        return self.meta.dataset_draw, self.meta.training_seed


def read_checkpoint(folder: Path, config: EvaluateConfig) -> Checkpoint:
    """Return the checkpoint in a folder, or the last one of a training run's folder.

    Args:
        folder: of the checkpoint.
        config: says what plain LeRobot's do not, their rate and perhaps their task.
    """
    place = model_folder(folder)
    settings = check_policy_folder(place)
    where = f"--policy {place}"
    meta = read_meta(place) if (place / NAME).is_file() else _plain(place, settings, config)
    task, hands = (config.task, meta.environment, TASKS), {meta.hand} - {"", MIXED}
    for asked, own, known in (task, (config.robot, meta.robot, ROBOTS), (config.hand, meta.hand, hands)):
        if asked and own in known and own != asked:
            raise HandrailError(f"{where}: expected one trained for {asked}, got {own!r}")
    TASKS.admit(meta.environment, (config.task,))  # before anything that a policy names is imported
    MODES.admit(meta.mode, (config.mode,))
    ROBOTS.admit(meta.robot, (config.robot,))
    sizes, pictures = _features(settings, where)
    pictures |= meta.cameras
    robot = meta.robot if meta.robot in ROBOTS else config.robot
    if meta.interface is None:
        task = meta.environment if meta.environment in TASKS else config.task
        if not (robot and task):
            raise HandrailError(f"{where}: expected --robot and --task: neither it nor its dataset says them")
        meta = replace(meta, environment=task)
        own = len(AgentObservation(load_model(robot)).names)  # more: robot and scene, of lerobot-record
        if config.mode and not meta.mode and ENVIRONMENT not in sizes and sizes.get(STATE) != own:
            meta = replace(meta, mode=config.mode, actions="intent")
    meta = replace(meta, robot=robot or meta.robot, hand=config.hand or meta.hand)
    if meta.hand == MIXED:
        raise HandrailError(f"{where}: expected --hand: in its demonstrations several hands do the task")
    if meta.interface and Channels.of(load_description(meta.robot)).names != meta.interface.channels:
        raise HandrailError(f"{where}: expected a robot with its channels, got --robot {meta.robot}")
    if not TASKS.accepts(meta.environment):
        raise HandrailError(f"{where}: expected a task of {', '.join(TASKS)}, got {meta.environment!r}")
    cameras = load_description(meta.robot).camera_names
    if unknown := [camera for camera in pictures if camera not in cameras]:
        words = f"expected one of {', '.join(cameras)}"
        raise HandrailError(f"{where}: reads the camera {unknown[0]!r}: {words}")
    movers, joined = _scene(sizes, where, meta)
    return Checkpoint(place, meta, pictures, movers, joined, _digest(place))


def _plain(place: Path, settings: Mapping[str, Any], config: EvaluateConfig) -> PolicyMeta:
    """Return what is known of a policy of plain `lerobot-train`: from its training and its dataset."""
    path, step = place / _TRAINED, place.parent.name
    content = load_json(path, "settings of LeRobot") if path.is_file() else {}
    training = check(content, _Trained, repr(str(path)))
    root, fps = Path(str((training.get("dataset") or {}).get("root") or place)), config.fps or 20
    origin: dict[str, Any] = {"environment": "", "robot": ""}
    with suppress(HandrailError, OSError):  # it need not be here
        origin, fps = origin_of(info := read_info(root), read_episodes(root)), info.fps
    origin["mode"] = ""  # its actions are the recorded ones, unless --mode says otherwise
    return PolicyMeta(
        interface=None,
        **origin,
        fps=fps,
        actions="recorded",
        training_seed=training.get("seed") or 0,
        dataset_draw=0,
        trained_on={},
        policy=settings["type"],
        steps=int(step) if step.isdecimal() else 0,
    )


def _features(settings: Mapping[str, Any], where: str) -> tuple[dict[str, int], dict[str, tuple[int, int]]]:
    """Return the sizes of what a policy reads and writes; of pictures height and width, by camera [px]."""
    sizes, pictures = {}, {}
    for which in ("input_features", "output_features"):
        features = check(settings.get(which) or {}, dict[str, _Shaped], f"{where}: {which}")
        for name, shape in ((name, feature["shape"]) for name, feature in features.items()):
            camera = name.removeprefix(PICTURE)
            if len(shape) != (1 if camera == name else 3):
                expected = "one dimension" if camera == name else "channels, height and width"
                raise HandrailError(f"{where}: {name}: expected {expected}, got {shape}")
            if camera == name:
                sizes[name] = shape[0]
            else:
                pictures[camera] = shape[1:]
    return sizes, pictures


def _scene(given: Mapping[str, int], where: str, meta: PolicyMeta) -> tuple[int, bool]:
    """Return of how many moving obstacles a policy knows, and if it reads robot and scene as one vector."""
    if meta.interface is not None:
        names = meta.interface.environment_names
        return len({name.split(".")[0] for name in names if name.startswith("mover_")}), False
    state, action = len(AgentObservation(load_model(meta.robot)).names), len(mode_action(meta).names)
    known: list[dict[str, int]] = []
    for movers in range(MOST_MOVING + 1 if TASKS.find(meta.environment).movers else 1):
        task = build_task(SessionConfig(task=meta.environment, moving_obstacles=movers))
        scene = len(task.state_names)
        known.append({STATE: state, ENVIRONMENT: scene, ACTION: action})
        if meta.intent_mode:
            known.append({STATE: state + scene, ACTION: action})
        for each in known[-2:]:
            if ACTION in given and given.items() <= each.items():
                return movers, ENVIRONMENT not in each
    expected = f"the features of {meta.robot} in {meta.environment}, as {known[0]}"
    raise HandrailError(f"{where}: expected {expected}; got {given}")


def mode_action(meta: PolicyMeta) -> ModeAction:
    """Return what a policy writes that writes what was recorded."""
    model = load_model(meta.robot).with_hand(meta.hand)
    mode = build_mode(SessionConfig(task=meta.environment, mode=meta.intent_mode or "direct"), model)
    return ModeAction(mode, Channels.of(model.description), model.hand.name)


def _digest(folder: Path) -> str:
    digest = hashlib.sha256()
    for path in sorted(folder.iterdir()):
        if not path.is_file() or path.name == _TRAINED:
            continue
        digest.update(path.name.encode())
        if path.name == NAME:
            kept = {key: value for key, value in read_json(path).items() if key != "training"}
            digest.update(json.dumps(kept).encode())
        else:
            with open_regular(path) as file:
                hashlib.file_digest(file, lambda: digest)  # adds the file to it
    return digest.hexdigest()[:16]


@dataclass(frozen=True)
class PolicyCondition:
    """A checkpoint under a condition."""

    checkpoint: Checkpoint
    protection: str
    """The controller between it and the robot: `none`, `mpc`, `filter`, or a mode's `cbf`."""
    perturbation: Perturbation
    time_limit: float
    """Time after which a rollout is given up [s]; the task's own when 0."""
    label: str

    @property
    def conditions(self) -> dict[str, str]:
        """The values that all rollouts of this label share."""
        return {
            **{name: str(getattr(self.checkpoint.meta, name)) for name in _SAID},
            **({"hand": hand} if (hand := self.checkpoint.meta.hand) else {}),
            "protection": self.protection,
            "perturbation": self.perturbation.text,
            "time_limit": f"{self.time_limit:g}",
        }


def policy_conditions(config: EvaluateConfig) -> tuple[list[PolicyCondition], list[str]]:
    """Return every checkpoint under every condition of the settings, and why some cannot be."""
    refused: dict[str, None] = {}
    checkpoints, found = [], dict[tuple[str, tuple[int, int]], PolicyCondition]()
    for folder in config.folders:
        try:
            checkpoints.append(_as_asked(read_checkpoint(folder, config), config))
        except HandrailError as error:
            refused[str(error)] = None
    modes = {checkpoint.meta.mode for checkpoint in checkpoints}
    if config.mode and modes and config.mode not in modes:
        raise HandrailError(f"--mode {config.mode}: expected a policy of it, got {', '.join(sorted(modes))}")
    environments = {checkpoint.meta.environment for checkpoint in checkpoints}
    if len(environments) > 1:
        raise HandrailError(f"--policy: expected policies of one task, got {', '.join(sorted(environments))}")
    for perturbation, protection, checkpoint in itertools.product(
        config.perturbations, config.protections, checkpoints
    ):
        try:
            condition = _condition(perturbation, protection, checkpoint, config)
        except HandrailError as error:
            refused[str(error)] = None
            continue
        before = found.setdefault((condition.label, checkpoint.key), condition)
        if before != condition:
            words = "expected each dataset draw and training seed once under a --label"
            raise HandrailError(f"--policy {checkpoint.folder}: {words}, got {before.checkpoint.folder} too")
    if not found:
        raise HandrailError("; ".join(refused))
    return list(found.values()), list(refused)


def _as_asked(checkpoint: Checkpoint, config: EvaluateConfig) -> Checkpoint:
    """Return a checkpoint whose mode and rate are those of the settings, where these say any."""
    for name in ("mode", "fps"):
        asked, own = getattr(config, name), getattr(checkpoint.meta, name)
        is_trusted = name == "mode" and asked not in MODES  # a `module:name`: others may have other modes
        if asked and asked != own and not is_trusted:
            raise HandrailError(
                f"--policy {checkpoint.folder}: expected --{name} {own or 'left out'}, got {asked}"
            )
    return checkpoint


def own_protection(mode: str) -> str:
    """Return the protection that a policy's actions have by themselves: intents of a mode, or none of any."""
    if not mode:
        return "none"
    spec = CONTROLLERS.find(MODES.find(mode).controller)
    return spec.name if spec.protects else "none"


def _condition(
    perturbation: Perturbation, protection: str, checkpoint: Checkpoint, config: EvaluateConfig
) -> PolicyCondition:
    meta, mode = checkpoint.meta, checkpoint.meta.intent_mode
    if not (checkpoint.pictures or perturbation.sizes.keys().isdisjoint(PICTURES)):
        words = f"expected a policy that sees pictures; {checkpoint.folder} reads none"
        raise HandrailError(f"--perturbation {perturbation.text}: {words}")
    own = own_protection(mode)
    chosen = own if protection == "own" else protection
    if mode and chosen not in (own, "none"):
        words = f"own or none, or a policy of joint velocities; {checkpoint.folder} writes intents"
        raise HandrailError(f"--protection {protection}: expected {words} of mode {mode}")
    name = config.label or " ".join(filter(None, (meta.mode or meta.policy, "intent" if mode else "")))
    protected = {"none": "unprotected", own: ""}.get(chosen, chosen)
    label = " ".join(filter(None, (name, protected, perturbation.words)))
    return PolicyCondition(checkpoint, chosen, perturbation, config.time_limit or meta.time_limit, label)
