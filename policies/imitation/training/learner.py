"""A policy in training, made of LeRobot's parts: policy, processors, optimizer, schedule."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from accelerate import Accelerator
from accelerate.utils import DistributedDataParallelKwargs, DistributedType, send_to_device
from lerobot.common.train_utils import load_training_state
from lerobot.configs.train import TrainPipelineConfig
from lerobot.optim.factory import make_optimizer_and_scheduler
from lerobot.policies.factory import make_policy, make_pre_post_processors
from lerobot.utils.random_utils import set_seed
from torch.optim.lr_scheduler import LambdaLR

from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.interface.checkpoint import MODEL
from handrail.policies.imitation.interface.steps import without_steps
from handrail.policies.imitation.interface.trained import check_numbers, load_weights
from handrail.policies.imitation.training.memory import MemoryDataset, MemoryMeta
from handrail.policies.imitation.training.plateau import Plateau

_WHOLE_MODEL = (DistributedType.NO, DistributedType.MULTI_CPU, DistributedType.MULTI_GPU)  # in every process
_PRECISIONS = {"float32": "no", "bfloat16": "bf16", "float16": "fp16"}  # accelerate's names
_FRAMES = 2048  # measured at most, spread evenly: it takes as long as some twenty updates
_SEED = 0  # of what a policy draws to compute its loss: the same for every measurement


@dataclass(frozen=True)
class Learner:
    """A policy in training, spread over the processes."""

    accelerator: Accelerator
    policy: Any
    optimizer: Any
    schedule: Any
    """Of the learning rate; may be None."""
    before: Any
    """The policy's processor that normalises."""
    after: Any
    """The reverse."""
    step: int
    """Updates already made when it was built."""

    def loss_on(self, held_out: MemoryDataset, batch_size: int) -> float:
        """Return the loss on episodes, the same in every process; what is random goes on as before."""
        policy, count = self.accelerator.unwrap_model(self.policy), len(held_out)
        frames = np.unique(np.linspace(0, count - 1, min(count, _FRAMES)).round().astype(int)).tolist()
        total = 0.0
        policy.eval()
        with torch.random.fork_rng(), torch.no_grad(), self.accelerator.autocast():
            torch.manual_seed(_SEED)
            for start in range(0, len(frames), batch_size):
                indices = frames[start : start + batch_size]
                batch = self.before(send_to_device(held_out.batch(indices), self.accelerator.device))
                total += policy.forward(batch)[0].item() * len(indices)
        policy.train()
        mean: Any = torch.tensor(total / len(frames), device=self.accelerator.device)
        reduced: Any = self.accelerator.reduce(mean, reduction="mean")
        return float(reduced)


def build_learner(
    settings: TrainPipelineConfig, meta: MemoryMeta, checkpoint: Path | None, plateau: Plateau | None = None
) -> Learner:
    """Return a learner made anew, or as it was when a checkpoint was written, what is random included.

    Args:
        settings: LeRobot's.
        meta: of what it learns from.
        checkpoint: to go on from; None to begin.
        plateau: says how the learning rate goes; None for the settings' schedule.
    """
    described = settings.policy
    assert described is not None
    accelerator = _accelerator(described)
    set_seed(settings.seed, accelerator)  # pyright: ignore[reportArgumentType]
    place = None if checkpoint is None else checkpoint / MODEL
    if place is not None:
        described.pretrained_path = place
    stats: Any = meta.stats
    policy: Any = make_policy(described, meta)  # pyright: ignore[reportArgumentType]
    if place is None:
        around = make_pre_post_processors(described, dataset_stats=stats)
    else:
        device = {"device_processor": {"device": accelerator.device.type}}
        around = make_pre_post_processors(described, str(place), preprocessor_overrides=device)
        load_weights(policy, place)  # LeRobot leaves out what does not fit
        check_numbers(policy, around, place)
    step: int = 0
    optimizer, schedule = make_optimizer_and_scheduler(settings, policy)
    if plateau is not None:
        schedule = LambdaLR(optimizer, plateau.rate)
    if isinstance(optimizer, torch.optim.Adam):
        for group in optimizer.param_groups:  # all weights in one call
            group["fused"], group["foreach"] = True, False
    if checkpoint is not None:
        step, optimizer, schedule = load_training_state(checkpoint, optimizer, schedule)
    policy, optimizer, schedule = accelerator.prepare(policy, optimizer, schedule)
    before, after = map(without_steps, around)  # the data in memory are seen so already
    return Learner(accelerator, policy, optimizer, schedule, before, after, step)


def _accelerator(policy: Any) -> Accelerator:
    """Return what spreads a training over the processes it was started in, at the policy's precision."""
    torch.backends.cudnn.benchmark = True
    torch.backends.cuda.matmul.allow_tf32 = True
    precision = None
    if hasattr(policy, "dtype"):
        precision = _PRECISIONS.get(policy.dtype)
    elif getattr(policy, "use_amp", False):
        mixed = torch.get_autocast_dtype(torch.device(policy.device).type)
        precision = _PRECISIONS[str(mixed).removeprefix("torch.")]
    accelerator = Accelerator(
        step_scheduler_with_optimizer=False,
        mixed_precision=precision,
        kwargs_handlers=[DistributedDataParallelKwargs(find_unused_parameters=True)],
        cpu=policy.device == "cpu",
    )
    kind = accelerator.distributed_type
    if kind not in _WHOLE_MODEL:
        raise HandrailError(f"accelerate launch: expected one process or --multi_gpu, got {kind.value}")
    return accelerator
