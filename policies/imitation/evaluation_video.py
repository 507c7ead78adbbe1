"""A rollout as a video."""

from pathlib import Path

from handrail.collect.film import SIZE, Filmer
from handrail.collect.gl import graphics_trouble
from handrail.datasets.frames import Moment
from handrail.policies.imitation.arms import arms
from handrail.policies.imitation.evaluate_config import EvaluateConfig
from handrail.policies.imitation.evaluation import load_trained
from handrail.policies.imitation.rollout import Load, Rollout, run_rollout


def film(config: EvaluateConfig, load: Load = load_trained) -> str:
    """Film the first rollout of the settings; return why there is no video, empty if there is one.

    Args:
        config: what is evaluated.
        load: reads the policy of a checkpoint folder.
    """
    trouble = graphics_trouble()
    if trouble:
        return trouble
    arm = arms(config, refused=[])[0]
    rollout = Rollout(arm, config.seeds[0])
    with Filmer(Path(config.video).expanduser(), arm.checkpoint.meta.fps, arm.label, _words) as filmer:
        run_rollout(rollout, load, (filmer,), SIZE)
    return ""


def _words(moment: Moment) -> str:
    """Say when it is, how near things are and how the controller fares."""
    health = moment.health
    return (
        f"{moment.intent.time:5.1f} s     nearest: {health.smallest_distance:.3f} m     "
        f"contacts: {moment.contacts}     controller: {health.status.value}"
    )
