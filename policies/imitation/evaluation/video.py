"""A rollout as a video."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from handrail.collect.session.film import SIZE, Filmer
from handrail.collect.world.gl import graphics_trouble
from handrail.datasets.recording.frames import Frame
from handrail.policies.imitation.evaluation.conditions import policy_conditions
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.evaluation.rollout import Load, run_rollout
from handrail.policies.imitation.interface.trained import load_policy


def film(config: EvaluateConfig, content: Mapping[str, Any], load: Load = load_policy) -> str:
    """Film the first rollout of the first policy that drove; return why there is no video, or nothing.

    Args:
        config: what was evaluated.
        content: of the evaluation file.
        load: reads the policy of a checkpoint folder.
    """
    trouble = graphics_trouble()
    if trouble:
        return trouble
    drove = {entry.get("checkpoint") for entries in content["arms"].values() for entry in entries}
    conditions, _ = policy_conditions(config)
    condition = next((each for each in conditions if each.checkpoint.digest in drove), None)
    if condition is None:
        return "no policy drove"
    fps = condition.checkpoint.meta.fps
    with Filmer(Path(config.video).expanduser(), fps, condition.label, _words) as filmer:
        run_rollout(condition, config.seeds[0], load, (filmer,), SIZE)
    return ""


def _words(frame: Frame) -> str:
    """Say when it is, how near things are and how the controller fares."""
    diagnostics = frame.diagnostics
    return (
        f"{frame.intent.time:5.1f} s     nearest: {diagnostics.smallest_distance:.3f} m     "
        f"contacts: {frame.contacts}     controller: {diagnostics.status.value}"
    )
