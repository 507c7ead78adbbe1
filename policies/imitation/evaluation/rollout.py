"""One rollout of a trained policy through the one session loop."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from handrail.collect.config import SessionConfig
from handrail.collect.envs.env import HandrailEnv
from handrail.collect.perturbations.delayed import DelayedOperator
from handrail.collect.perturbations.push import Pusher
from handrail.collect.session.build import build_env
from handrail.collect.session.outcome import Outcome
from handrail.collect.session.session import Observer, Session
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import Controller
from handrail.policies.imitation.evaluation.conditions import PolicyCondition
from handrail.policies.imitation.evaluation.operator import Policy, PolicyOperator
from handrail.policies.imitation.evaluation.protection import build_protection
from handrail.policies.imitation.evaluation.torch_state import one_thread, repeatable

Load = Callable[[Path], Policy]
Row = dict[str, Any]


@dataclass(frozen=True)
class Rollout:
    """What to run.

    Attributes:
        arm: policy and condition.
        seed: of the episode.
    """

    arm: PolicyCondition
    seed: int


def run_rollout(
    rollout: Rollout,
    load: Load,
    observers: Sequence[Observer] = (),
    render: tuple[int, int] | bool = False,
) -> Row:
    """Run a policy once and return how it went, as an evaluation file has it.

    Args:
        rollout: what to run.
        load: reads the policy of a folder.
        observers: shown every moment.
        render: height and width of good-looking pictures that the environment draws [px], if it does.
    """
    arm = rollout.arm
    env = _env(_session_config(arm), arm.checkpoint.meta.fps, arm.perturbation.shift, render)
    controller = _controller(arm.protection, arm.checkpoint.intent_mode, arm.checkpoint.meta.environment, env)
    policy = _policy(arm.checkpoint.folder, arm.checkpoint.digest, load)
    with one_thread(), repeatable(rollout.seed):
        operator = PolicyOperator(policy, Channels.of(env.model.description), arm.checkpoint.meta.mode)
        perturbation = arm.perturbation
        late = DelayedOperator(operator, perturbation.delay)
        pushers = (Pusher(perturbation.push),) if perturbation.push else ()
        session = Session(env, controller, late, observers, disturbances=pushers)
        outcome = session.run(rollout.seed)
    return _row(outcome, operator.malformed)


def _session_config(arm: PolicyCondition) -> SessionConfig:
    meta, pictures = arm.checkpoint.meta, arm.checkpoint.pictures
    sizes = {size for picture in pictures.values() for size in picture} or {128}
    if len(sizes) > 1:
        raise HandrailError(f"{arm.checkpoint.folder}: expected square pictures of one size, got {pictures}")
    return SessionConfig(
        task=meta.environment,
        robot=meta.robot,
        moving_obstacles=arm.checkpoint.movers,
        cameras=",".join(pictures),
        image_size=sizes.pop(),
        time_limit=arm.time_limit,
    )


@lru_cache(maxsize=8)
def _env(config: SessionConfig, fps: int, shift: float, render: tuple[int, int] | bool) -> HandrailEnv:
    """Return an environment, built once a process."""
    return build_env(config, fps, render, shift)


@lru_cache(maxsize=8)
def _controller(protection: str, mode: str, task: str, env: HandrailEnv) -> Controller:
    """Return a controller, built once a process."""
    return build_protection(protection, mode, task, env.model, env.fps)


@lru_cache(maxsize=4)
def _policy(folder: Path, digest: str, load: Load) -> Policy:
    """Return a policy, read once a process."""
    return load(folder)


def _row(outcome: Outcome, malformed: int) -> Row:
    period = outcome.seconds / outcome.frames
    row: Row = {
        "seed": outcome.seed,
        "success": outcome.success,
        "contacts": outcome.contacts,
        "contact_time": round(period * outcome.contact_periods, 6),
        "length": round(outcome.seconds, 6),
        "brakes": outcome.brakes,
        "malformed": malformed,
        "failure_reason": outcome.failure_reason,
    }
    if np.isfinite(outcome.smallest_distance):
        row["smallest_distance"] = outcome.smallest_distance
    if outcome.success:
        row["time_to_success"] = row["length"]
    parts = {"policy": "operator", "controller": "controller", "environment": "environment"}
    timing = {name: 1e3 * outcome.spent[part] / outcome.frames for name, part in parts.items()}
    return row | {"timing": {name: round(value, 3) for name, value in timing.items()}}
