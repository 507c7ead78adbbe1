"""Evaluates trained policies: every checkpoint under every condition on the same declared seeds."""

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np

from handrail.collect.execution.execution import Execution
from handrail.collect.execution.job import Job
from handrail.collect.session.film import SIZE, Filmer
from handrail.collect.world.gl import graphics_trouble
from handrail.controllers.errors import HandrailError
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.recording.frames import Frame
from handrail.datasets.storage.atomic import beside, explained
from handrail.datasets.storage.lock import FolderLock
from handrail.policies.imitation.evaluation.conditions import policy_conditions
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.evaluation.file import EvaluationFile
from handrail.policies.imitation.evaluation.rollout import Load, run_rollout
from handrail.policies.imitation.interface.encoder import Encoder
from handrail.policies.imitation.interface.trained import load_policy

_PRELOAD = ("handrail.policies.imitation.evaluation.rollout",)
SAVE_EVERY = 2.0  # [s]


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
    path, alone = Path(config.json).expanduser() if config.json else None, nullcontext()
    if path:
        with explained(f"--json {path}"):
            alone = FolderLock(beside(path, "lock"), f"--json {path}", "handrail-evaluate")
    with alone:
        conditions, refused = policy_conditions(config)
        file = EvaluationFile(path, conditions)
        asked = {
            f"{each.label} of {each.checkpoint.folder}, seed {seed}": (each, seed)
            for each in conditions
            for seed in config.seeds
            if seed not in file.done(each)
        }
        failed, successes, saved = dict[Path, str](), 0, monotonic()

        def wanted(job: Job) -> bool:
            return asked[job.name][0].checkpoint.folder not in failed

        jobs = [Job(name, run_rollout, (*rollout, load)) for name, rollout in asked.items()]
        try:
            with Execution(config, "rollouts", console, _PRELOAD) as execution:
                for count, result in enumerate(execution.run(jobs, wanted), start=1):
                    condition, _ = asked[result.job.name]
                    if result.error:
                        failed.setdefault(condition.checkpoint.folder, result.error)
                        continue
                    file.add(condition, result.value)
                    successes += result.value["success"]
                    execution.say(f"{successes}/{count} succeeded")
                    if monotonic() - saved > SAVE_EVERY:
                        file.save()
                        saved = monotonic()
        finally:
            file.save()
        refused += failed.values()
        if refused and not file.content["arms"]:
            raise HandrailError("; ".join(refused))
        if refused:
            raise UnevaluatedError(file.content, refused)
        return file.content


def film(config: EvaluateConfig, content: Mapping[str, Any], load: Load = load_policy) -> str:
    """Film the first rollout of the first policy that drove; return why there is no video, or nothing.

    Args:
        config: what was evaluated.
        content: of the evaluation file.
        load: reads the policy of a checkpoint folder.
    """
    if trouble := graphics_trouble():
        return trouble
    drove = {entry.get("checkpoint") for entries in content["arms"].values() for entry in entries}
    conditions, _ = policy_conditions(config)
    condition = next((each for each in conditions if each.checkpoint.digest in drove), None)
    if condition is None:
        return "no policy drove"
    fps, encoder = condition.checkpoint.meta.fps, load(condition.checkpoint.folder).encoder
    insets = partial(_looked, encoder)
    with Filmer(Path(config.video).expanduser(), fps, condition.label, _words, insets) as filmer:
        run_rollout(condition, config.seeds[0], load, (filmer,), SIZE)
    return ""


def _looked(encoder: Encoder | None, frame: Frame) -> list[np.ndarray]:
    """Return what the cameras see; red is where a change would change most what an encoder says."""
    if encoder is None:
        return list(frame.images.values())
    heat = encoder.saliency(frame.images)
    shown: list[np.ndarray] = []
    for name, warm in heat.items():
        grey = frame.images[name].mean(axis=2, keepdims=True) * (1.0 - warm[..., None])
        shown.append((grey + warm[..., None] * [255.0, 40.0, 0.0]).astype(np.uint8))
    return shown


def _words(frame: Frame) -> str:
    """Return the time, the nearest distance and the state of the controller."""
    diagnostics = frame.diagnostics
    return (
        f"{frame.intent.time:5.1f} s     nearest: {diagnostics.smallest_distance:.3f} m     "
        f"contacts: {frame.contacts}     controller: {diagnostics.status.value}"
    )
