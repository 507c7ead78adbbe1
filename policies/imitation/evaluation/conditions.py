"""What is evaluated: a checkpoint under a condition."""

import itertools
from dataclasses import dataclass

from handrail.collect.operators.modes import MODES
from handrail.collect.session.perturbations import Perturbation
from handrail.controllers.baselines.catalogue import CONTROLLERS
from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.evaluation.checkpoint import Checkpoint, read_checkpoint
from handrail.policies.imitation.evaluation.config import EvaluateConfig

_SAID = ("environment", "robot", "mode", "fps", "actions")


@dataclass(frozen=True)
class PolicyCondition:
    """A checkpoint under a condition."""

    checkpoint: Checkpoint
    protection: str
    """What stands between it and the robot: `none`, `mpc`, `filter`, or a mode's `cbf`."""
    perturbation: Perturbation
    time_limit: float
    """Time after which a rollout is given up [s]; the task's own when 0."""
    label: str

    @property
    def conditions(self) -> dict[str, str]:
        """What all rollouts of this label have in common."""
        return {
            **{name: str(getattr(self.checkpoint.meta, name)) for name in _SAID},
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
            checkpoints.append(read_checkpoint(folder, config))
        except HandrailError as error:
            refused[str(error)] = None
    environments = {checkpoint.meta.environment for checkpoint in checkpoints}
    if len(environments) > 1:
        raise HandrailError(
            f"--policy: expected policies for one task, got {', '.join(sorted(environments))}"
        )
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
    own = own_protection(mode)
    chosen = own if protection == "own" else protection
    if mode and chosen not in (own, "none"):
        words = f"own or none, or a policy of joint velocities; {checkpoint.folder} writes intents"
        raise HandrailError(f"--protection {protection}: expected {words} of mode {mode}")
    name = config.label or " ".join(filter(None, (meta.mode or meta.policy, "intent" if mode else "")))
    protected = {"none": "unprotected", own: ""}.get(chosen, chosen)
    label = " ".join(filter(None, (name, protected, perturbation.words)))
    return PolicyCondition(checkpoint, chosen, perturbation, config.time_limit or meta.time_limit, label)
