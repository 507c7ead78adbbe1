"""A trained policy that drives while a person, or a script, supervises it and may take over."""

from pathlib import Path

import numpy as np
import torch

from handrail.collect.config import RecordConfig
from handrail.collect.operators.catalogue import OPERATORS
from handrail.collect.operators.modes import MODES, TeleopMode
from handrail.collect.operators.operator import Operator, View
from handrail.collect.operators.scripted.steering import Gains, full_stick
from handrail.collect.operators.shared.arbiter import Groups
from handrail.collect.operators.shared.catalogue import ARBITERS
from handrail.collect.operators.shared.planning import Ensemble, Planner, ThreadedPlanner
from handrail.collect.operators.shared.shared_operator import SharedOperator
from handrail.collect.session.build import build_mode, build_modes
from handrail.collect.world.env import HandrailEnv
from handrail.controllers.baselines.catalogue import CONTROLLERS
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent
from handrail.controllers.registry import resolved
from handrail.policies.imitation.evaluation.conditions import Checkpoint, read_checkpoint
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.evaluation.policy_operator import PolicyOperator
from handrail.policies.imitation.interface.compute import threads
from handrail.policies.imitation.interface.trained import load_policy


def share(config: RecordConfig, person: Operator, env: HandrailEnv) -> SharedOperator:
    """Return a person and the policies of the settings as one operator.

    In real time the policy plans in a thread of its own. Several are an ensemble, whose first drives.

    Args:
        config: of the recording.
        person: who supervises.
        env: of the recording.
    """
    mode = build_mode(config, env.model)
    if not _is_completed(mode):
        fit = ", ".join(name for name, each in build_modes(config, env).items() if _is_completed(each))
        raise HandrailError(f"--mode {mode.name}: expected one that the MPC completes beside a policy: {fit}")
    usual = "" if config.mask else config.mode
    asked = EvaluateConfig(
        task=config.task, robot=config.robot, mode=usual, hand=config.hand, fps=round(env.fps)
    )
    checkpoints = [read_checkpoint(Path(folder).expanduser(), asked) for folder in config.policy]
    for checkpoint in checkpoints:
        _check_fits(checkpoint, config, env)
    members = [_Driver(load_policy(each.folder), each, env, env.period) for each in checkpoints]
    channels = Channels.of(env.model.description)
    planner: Planner = members[0]
    if len(members) > 1:
        gains = Gains().within(env.model.description.world)
        planner = Ensemble(members, full_stick(channels, gains))
    if OPERATORS.find(config.operator).interactive or config.realtime or config.robot_client:
        planner = ThreadedPlanner(planner, env.period)
    groups = Groups(channels)
    arbiter = resolved(ARBITERS.find(config.arbiter).build)(groups, config.arbitration)
    modes = {each.name for each in (mode, *MODES.values()) if _is_completed(each)}
    return SharedOperator(person, planner, arbiter, env.model, modes.__contains__)


def _is_completed(mode: TeleopMode) -> bool:
    return CONTROLLERS.find(mode.controller).objectives


def _check_fits(checkpoint: Checkpoint, config: RecordConfig, env: HandrailEnv) -> None:
    """Check that a policy can drive in a recording."""
    meta, where = checkpoint.meta, f"--policy {checkpoint.folder}"
    for name, own, here in (
        ("--task", meta.environment, config.task),
        ("--robot", meta.robot, config.robot),
        ("--robot_fps" if config.robot_fps else "--dataset.fps", meta.fps, env.fps),
        ("--hand", meta.hand or env.model.with_hand("").hand.name, env.model.hand.name),
        ("--moving_obstacles", checkpoint.movers, config.moving_obstacles),
    ):
        if own != here:
            raise HandrailError(f"{where}: expected {name} {own}, as it was trained, got {here}")
    for camera, size in checkpoint.pictures.items():
        if camera not in env.cameras or size != env.image_size:
            cameras, (height, width) = ",".join(checkpoint.pictures), size
            flags = f"--cameras {cameras} --image_size {width}x{height}"
            raise HandrailError(f"{where}: reads pictures: expected {flags} or more cameras")


class _Driver(PolicyOperator):
    """Its random draws depend on the episode's seed alone; PyTorch computes with one thread."""

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin an episode."""
        torch.manual_seed(int(rng.integers(2**31)))
        super().reset(view, rng)

    def act(self, view: View) -> Intent:
        """Return the intent now."""
        with threads(1):
            return super().act(view)
