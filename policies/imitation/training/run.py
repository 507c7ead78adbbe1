"""A training: LeRobot's parts and update, over our data in LeRobot's order, into our checkpoints."""

import math
import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import torch
from accelerate import Accelerator
from accelerate.data_loader import BatchSamplerShard
from accelerate.utils import DistributedDataParallelKwargs, DistributedType, send_to_device
from lerobot.common.train_utils import (
    get_step_checkpoint_dir,
    load_training_state,
    save_checkpoint,
    should_save_checkpoint,
)
from lerobot.configs.train import TrainPipelineConfig
from lerobot.datasets.sampler import EpisodeAwareSampler, compute_sampler_state
from lerobot.optim.factory import make_optimizer_and_scheduler
from lerobot.policies.factory import make_policy, make_pre_post_processors
from lerobot.scripts.lerobot_train import update_policy
from lerobot.utils.logging_utils import AverageMeter, MetricsTracker
from lerobot.utils.random_utils import set_seed
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from torch.utils.data import BatchSampler

from handrail.controllers.errors import HandrailError
from handrail.controllers.interrupts import Interrupts
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.storage.atomic import publish_folder
from handrail.policies.imitation.interface.checkpoint import MODEL, PolicyMeta, point_to, write_meta
from handrail.policies.imitation.interface.encoder import Encoder
from handrail.policies.imitation.interface.steps import Completion, with_steps, without_steps
from handrail.policies.imitation.interface.trained import check_numbers, load_weights
from handrail.policies.imitation.training.curve import Curve, read_sums, write_sums
from handrail.policies.imitation.training.earlier import check_pictures
from handrail.policies.imitation.training.memory import MemoryDataset

_WHOLE_MODEL = (DistributedType.NO, DistributedType.MULTI_CPU, DistributedType.MULTI_GPU)  # in every process
_PRECISIONS = {"float32": "no", "bfloat16": "bf16", "float16": "fp16"}  # accelerate's names
_FRAMES = 2048  # measured at most, spread evenly: it takes as long as some twenty updates
_SEED = 0  # of what a policy draws to compute its loss: the same for every measurement
_OVER_PROCESSES = {"loss": "mean", "grad_norm": "none", "lr": "none"}
_OVER_PROCESSES |= dict.fromkeys(("update_s", "dataloading_s", "gpu_mem_gb"), "max")


class TrainingRun:
    """One training, made anew, or as it was when a checkpoint was written, what is random included.

    Args:
        settings: LeRobot's.
        learnt: what is learnt from.
        checkpoint: to go on from; None to begin.
        weights: folder of the policy whose weights and normalisation it begins with; None for its own.
        encoder: that reads pictures for the policy when it drives.
    """

    def __init__(
        self,
        settings: TrainPipelineConfig,
        learnt: MemoryDataset,
        checkpoint: Path | None,
        weights: Path | None,
        encoder: Encoder | None,
    ) -> None:
        described = settings.policy
        assert described is not None
        assert settings.output_dir is not None
        self._settings, self._learnt, self._encoder = settings, learnt, encoder
        dropped = getattr(described, "drop_n_last_frames", 0)
        self._drawn = learnt.draws.frames(dropped)
        if not len(self._drawn):
            raise HandrailError(f"training: expected episodes or corrections over {dropped} frames, got none")
        self._folder, self._sums = settings.output_dir, read_sums(checkpoint)
        self._accelerator = _accelerator(described)
        set_seed(settings.seed, self._accelerator)  # pyright: ignore[reportArgumentType]
        if weights is not None:
            described.pretrained_path = weights
        stats: Any = learnt.meta.stats
        policy: Any = make_policy(described, learnt.meta)  # pyright: ignore[reportArgumentType]
        if weights is None:
            around = make_pre_post_processors(described, dataset_stats=stats)
        else:
            check_pictures(weights, policy.config)
            device = {"device_processor": {"device": self._accelerator.device.type}}
            around = make_pre_post_processors(described, str(weights), preprocessor_overrides=device)
            load_weights(policy, weights)  # LeRobot leaves out what does not fit
            check_numbers(policy, around, weights)
            described.pretrained_path = None  # a place on this computer is no part of a policy
        optimizer, schedule = make_optimizer_and_scheduler(settings, policy)
        if isinstance(optimizer, torch.optim.Adam):
            for group in optimizer.param_groups:  # all weights in one call
                group["fused"], group["foreach"] = True, False
        self._step: int = 0
        if checkpoint is not None:
            self._step, optimizer, schedule = load_training_state(checkpoint, optimizer, schedule)
        parts: Any = self._accelerator.prepare(policy, optimizer, schedule)
        self._policy, self._optimizer, self._schedule = parts
        self._before, self._after = map(without_steps, around)  # the data in memory are seen so already

    def train(
        self,
        meta: Callable[[int], PolicyMeta],
        held_out: MemoryDataset | None,
        losses: dict[int, float],
        every: int,
    ) -> None:
        """Train to the end; one of the processes writes checkpoints and the curve, and shows the progress.

        Args:
            meta: describes the policy after so many updates.
            held_out: episodes on which the loss is measured.
            losses: on these, by update: as they are measured.
            every: updates between two measurements.

        Raises:
            KeyboardInterrupt: it was interrupted; the update is finished, and its checkpoint written.
        """
        settings, main, means = self._settings, self._accelerator.is_main_process, self._means()
        assert settings.optimizer is not None
        around = settings.optimizer.grad_clip_norm, self._accelerator, self._schedule
        curve = Curve(self._folder, self._step) if main else None
        columns = TextColumn("training"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
        loss = TextColumn("{task.description}")
        with (
            Progress(*columns, loss, console=Terminal(stderr=True), disable=not main) as progress,
            Interrupts() as interrupts,
            interrupts.deferred(),
        ):
            bar = progress.add_task("", total=settings.steps, completed=self._step)
            batches, ends = self._batches(self._step), False
            while self._step < settings.steps and not ends:
                self._step += 1
                began = time.perf_counter()
                batch = self._before(next(batches))
                means.dataloading_s = time.perf_counter() - began
                update_policy(means, self._policy, batch, self._optimizer, *around)
                means.step()
                progress.advance(bar)
                if self._step % settings.log_freq == 0:
                    means.reduce_across_ranks()
                    if curve is not None:
                        curve.add(row := means.to_dict() | {"step": self._step})
                        progress.update(bar, description=f"loss {row['loss']:.4f}")
                    means.reset_averages()
                if held_out and (self._step % every == 0 or self._step == settings.steps):
                    losses[self._step] = self._loss_on(held_out)
                ends = interrupts.asked
                if ends or should_save_checkpoint(self._step, settings.save_freq, settings.steps):
                    if main:
                        self._save(meta(self._step), means)
                    if not ends:  # of other processes' interrupts this one does not know
                        self._accelerator.wait_for_everyone()
        self._accelerator.end_training()

    def _loss_on(self, held_out: MemoryDataset) -> float:
        """Return the loss on episodes, the same in every process; what is random goes on as before."""
        policy, drawn = self._accelerator.unwrap_model(self._policy), held_out.draws.frames()
        places = np.linspace(0, len(drawn) - 1, min(len(drawn), _FRAMES)).round().astype(int)
        frames = drawn[np.unique(places)].tolist()
        total, size, device = 0.0, self._settings.batch_size, self._accelerator.device
        policy.eval()
        with torch.random.fork_rng(), torch.no_grad(), self._accelerator.autocast():
            torch.manual_seed(_SEED)
            for start in range(0, len(frames), size):
                indices = frames[start : start + size]
                batch = self._before(send_to_device(held_out.batch(indices), device))
                total += policy.forward(batch)[0].item() * len(indices)
        policy.train()
        mean: Any = torch.tensor(total / len(frames), device=device)
        reduced: Any = self._accelerator.reduce(mean, reduction="mean")
        if not math.isfinite(loss := float(reduced)):
            words = f"got {loss} after {self._step} updates"
            raise HandrailError(f"training: expected a finite loss on held-out episodes, {words}")
        return loss

    def _means(self) -> MetricsTracker:
        meters = {name: AverageMeter(name, reduction=how) for name, how in _OVER_PROCESSES.items()}
        for name, (total, count) in self._sums.items():
            meters[name].sum, meters[name].count = total, count
        sizes = self._settings.batch_size, len(self._learnt), len(self._learnt.meta.lengths)
        accelerator: Any = self._accelerator
        return MetricsTracker(*sizes, meters, self._step, accelerator)

    def _batches(self, step: int) -> Iterator[Any]:
        """Yield batches for ever, from where a training that was cut off after a step goes on, to the bit."""
        settings, processes = self._settings, self._accelerator.num_processes
        each: Any = self._drawn, self._drawn + 1  # one by one, some of them several times
        sampler = EpisodeAwareSampler(*each, shuffle=True, seed=settings.seed or 0)
        state = compute_sampler_state(step, len(sampler), settings.batch_size, processes)
        sampler.load_state_dict(state)
        order: Any = BatchSampler(sampler, settings.batch_size, drop_last=False)
        if processes > 1:
            order = BatchSamplerShard(order, processes, self._accelerator.process_index)
        while True:
            for indices in order:
                yield send_to_device(self._learnt.batch(indices), self._accelerator.device)

    def _save(self, meta: PolicyMeta, means: MetricsTracker) -> None:
        folder = get_step_checkpoint_dir(self._folder, self._settings.steps, meta.steps)
        draft = folder.with_name(f".{folder.name}")
        shutil.rmtree(draft, ignore_errors=True)
        completion = Completion(meta.robot, meta.environment, meta.mode, meta.fps, meta.hand)
        around = with_steps(self._before, self._after, meta.interface, completion, self._encoder)
        policy, sizes = self._accelerator.unwrap_model(self._policy), self._settings.batch_size
        check_numbers(policy, (), folder)
        parts = (policy, self._optimizer, self._schedule, *around)
        save_checkpoint(draft, meta.steps, self._settings, *parts, self._accelerator.num_processes, sizes)
        write_sums(draft, means.metrics)
        write_meta(draft / MODEL, meta)
        publish_folder(draft, folder)
        point_to(folder)


def _accelerator(policy: Any) -> Accelerator:
    """Return what spreads a training over the processes it was started in, at the policy's precision."""
    torch.backends.cudnn.benchmark = True
    torch.backends.cuda.matmul.allow_tf32 = True
    dtype = getattr(policy, "dtype", None)
    if not hasattr(policy, "dtype") and getattr(policy, "use_amp", False):
        dtype = str(torch.get_autocast_dtype(torch.device(policy.device).type)).removeprefix("torch.")
    accelerator = Accelerator(
        step_scheduler_with_optimizer=False,
        mixed_precision=_PRECISIONS.get(dtype or ""),
        kwargs_handlers=[DistributedDataParallelKwargs(find_unused_parameters=True)],
        cpu=policy.device == "cpu",
    )
    kind = accelerator.distributed_type
    if kind not in _WHOLE_MODEL:
        raise HandrailError(f"accelerate launch: expected one process or --multi_gpu, got {kind.value}")
    return accelerator
