"""Evaluates trained policies: every checkpoint under every condition on the same declared seeds."""

from collections.abc import Sequence
from pathlib import Path
from time import monotonic
from typing import Any

from handrail.collect.execution.execution import Execution
from handrail.collect.execution.job import Job
from handrail.controllers.errors import HandrailError
from handrail.datasets.presentation.terminal import Terminal
from handrail.policies.imitation.evaluation.conditions import PolicyCondition, policy_conditions
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.evaluation.file import EvaluationFile
from handrail.policies.imitation.evaluation.rollout import Load, run_rollout
from handrail.policies.imitation.interface.trained import load_policy

Rollout = tuple[PolicyCondition, int]  # and the seed of its episode
_PRELOAD = ("handrail.policies.imitation.evaluation.rollout",)
_SAVE_EVERY = 2.0  # [s]


class UnevaluatedError(HandrailError):
    """Some policies could not be evaluated; the others were, and what they did is kept.

    Attributes:
        content: of the file.
        reasons: why not, a line for each.
    """

    def __init__(self, content: dict[str, Any], reasons: Sequence[str]) -> None:
        super().__init__("; ".join(reasons))
        self.content = content
        self.reasons = tuple(reasons)


def evaluate(
    config: EvaluateConfig, console: Terminal | None = None, load: Load = load_policy
) -> dict[str, Any]:
    """Run what is not in the file yet, write it, and return the content of the file.

    Every condition meets the same episodes and the same disturbances, and a rollout depends on nothing but
    its condition and seed: neither on where it runs nor on what ran before.

    Args:
        config: what to run.
        console: to show how far it is; nothing without one.
        load: reads the policy of a checkpoint folder.

    Raises:
        UnevaluatedError: some policies could not be evaluated, the others were.
        HandrailError: a setting is wrong, no policy could be evaluated, or the file cannot be written.
    """
    config.check()
    conditions, refused = policy_conditions(config)
    file = EvaluationFile(config.file if config.json else None)
    file.open(conditions)
    rollouts = [(each, seed) for each in conditions for seed in config.seeds if seed not in file.done(each)]
    try:
        refused += _run_all(rollouts, config, load, file, console)
    finally:
        file.save()
    if refused and not file.content["arms"]:
        raise HandrailError("; ".join(refused))
    if refused:
        raise UnevaluatedError(file.content, refused)
    return file.content


def _run_all(
    rollouts: Sequence[Rollout],
    config: EvaluateConfig,
    load: Load,
    file: EvaluationFile,
    console: Terminal | None,
) -> list[str]:
    """Run rollouts; return why some policies could not be."""
    conditions = {_name(*rollout): rollout[0] for rollout in rollouts}
    jobs = [Job(_name(*rollout), run_rollout, (*rollout, load)) for rollout in rollouts]
    saved, successes, refused = monotonic(), 0, dict[Path, str]()

    def wanted(job: Job) -> bool:
        return conditions[job.name].checkpoint.folder not in refused

    with Execution(config, "rollouts", console, _PRELOAD) as execution:
        for count, result in enumerate(execution.run(jobs, wanted), start=1):
            condition = conditions[result.job.name]
            if result.error:
                refused.setdefault(condition.checkpoint.folder, result.error)
                continue
            file.add(condition, result.value)
            successes += result.value["success"]
            execution.say(f"{successes}/{count} succeeded")
            if monotonic() - saved > _SAVE_EVERY:
                file.save()
                saved = monotonic()
    return list(refused.values())


def _name(condition: PolicyCondition, seed: int) -> str:
    return f"{condition.label} of {condition.checkpoint.folder}, seed {seed}"
