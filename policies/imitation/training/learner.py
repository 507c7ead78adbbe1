"""What a training changes, made of LeRobot's parts: policy, processors, optimizer, schedule."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from accelerate import Accelerator
from accelerate.utils import DistributedDataParallelKwargs, DistributedType
from lerobot.common.train_utils import load_training_state
from lerobot.configs.train import TrainPipelineConfig
from lerobot.optim.factory import make_optimizer_and_scheduler
from lerobot.policies.factory import make_policy, make_pre_post_processors
from torch.optim.lr_scheduler import LambdaLR

from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.interface.checkpoint import MODEL
from handrail.policies.imitation.interface.numbers import check_statistics, load_weights
from handrail.policies.imitation.interface.steps import without_steps
from handrail.policies.imitation.training.memory import MemoryMeta
from handrail.policies.imitation.training.plateau import Plateau

_WHOLE_MODEL = (DistributedType.NO, DistributedType.MULTI_CPU, DistributedType.MULTI_GPU)  # in every process


@dataclass(frozen=True)
class Learner:
    """A policy in training.

    Attributes:
        policy, optimizer, schedule: on their device, spread over the processes; the schedule may be None.
        before, after: the policy's processors: normalise, and the reverse.
        step: updates already made when it was built.
    """

    policy: Any
    optimizer: Any
    schedule: Any
    before: Any
    after: Any
    step: int


def build_learner(
    settings: TrainPipelineConfig,
    meta: MemoryMeta,
    checkpoint: Path | None,
    accelerator: Accelerator,
    plateau: Plateau | None = None,
) -> Learner:
    """Return a learner made anew, or as it was when a checkpoint was written, what is random included.

    Args:
        settings: LeRobot's.
        meta: of what it learns from.
        checkpoint: to go on from; None to begin.
        accelerator: of its processes.
        plateau: says how the learning rate goes; None for the settings' schedule.
    """
    described = settings.policy
    assert described is not None
    if checkpoint is not None:
        described.pretrained_path = checkpoint / MODEL
    stats: Any = meta.stats
    policy: Any = make_policy(described, meta)  # pyright: ignore[reportArgumentType]
    if checkpoint is None:
        around = make_pre_post_processors(described, dataset_stats=stats)
    else:
        device = {"device_processor": {"device": accelerator.device.type}}
        loaded = make_pre_post_processors(described, str(checkpoint / MODEL), preprocessor_overrides=device)
        load_weights(policy, checkpoint / MODEL)  # LeRobot leaves out what does not fit
        for pipeline in loaded:
            check_statistics(pipeline, checkpoint / MODEL)
        around = without_steps(loaded[0]), without_steps(loaded[1])  # the data in memory are seen so already
    step: int = 0
    optimizer, schedule = make_optimizer_and_scheduler(settings, policy)
    if plateau is not None:
        schedule = LambdaLR(optimizer, plateau.rate)
    _fuse(optimizer)
    if checkpoint is not None:
        step, optimizer, schedule = load_training_state(checkpoint, optimizer, schedule)
    policy, optimizer, schedule = accelerator.prepare(policy, optimizer, schedule)
    return Learner(policy, optimizer, schedule, *around, step)


def build_accelerator(policy: Any) -> Accelerator:
    """Return what spreads a training over the processes it was started in, at the policy's precision."""
    torch.backends.cudnn.benchmark = True
    torch.backends.cuda.matmul.allow_tf32 = True
    accelerator = Accelerator(
        step_scheduler_with_optimizer=False,
        mixed_precision=_precision(policy),
        kwargs_handlers=[DistributedDataParallelKwargs(find_unused_parameters=True)],
        cpu=policy.device == "cpu",
    )
    kind = accelerator.distributed_type
    if kind not in _WHOLE_MODEL:
        raise HandrailError(f"accelerate launch: expected one process or --multi_gpu, got {kind.value}")
    return accelerator


def _precision(policy: Any) -> str | None:
    """Return accelerate's name for the policy's `dtype`, or for what its device mixes if it has `use_amp`."""
    names = {"float32": "no", "bfloat16": "bf16", "float16": "fp16"}
    if hasattr(policy, "dtype"):
        return names.get(policy.dtype)
    if not getattr(policy, "use_amp", False):
        return None
    return names[str(torch.get_autocast_dtype(torch.device(policy.device).type)).removeprefix("torch.")]


def _fuse(optimizer: Any) -> None:
    """Let Adam update all weights in one call."""
    if isinstance(optimizer, torch.optim.Adam):
        for group in optimizer.param_groups:
            group["fused"], group["foreach"] = True, False
