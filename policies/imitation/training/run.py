"""The loop of a training: LeRobot's update, over our data in LeRobot's order, into our checkpoints."""

import math
import shutil
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from accelerate.data_loader import BatchSamplerShard
from accelerate.utils import send_to_device
from lerobot.common.train_utils import get_step_checkpoint_dir, save_checkpoint, should_save_checkpoint
from lerobot.configs.train import TrainPipelineConfig
from lerobot.datasets.sampler import EpisodeAwareSampler, compute_sampler_state
from lerobot.scripts.lerobot_train import update_policy
from lerobot.utils.logging_utils import AverageMeter, MetricsTracker
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from torch.utils.data import BatchSampler

from handrail.controllers.errors import HandrailError
from handrail.controllers.interrupts import Interrupts
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.storage.atomic import publish_folder
from handrail.policies.imitation.interface.checkpoint import MODEL, PolicyMeta, point_to, write_meta
from handrail.policies.imitation.interface.completion import Completion
from handrail.policies.imitation.interface.steps import with_steps
from handrail.policies.imitation.training.curve import Curve, read_sums, write_sums
from handrail.policies.imitation.training.learner import Learner, build_learner
from handrail.policies.imitation.training.memory import MemoryDataset
from handrail.policies.imitation.training.plateau import Plateau

_OVER_PROCESSES = {
    **{"loss": "mean", "grad_norm": "none", "lr": "none"},
    **{"update_s": "max", "dataloading_s": "max", "gpu_mem_gb": "max"},
}


@dataclass(frozen=True)
class TrainingRun:
    """One training, from its beginning or from a checkpoint."""

    settings: TrainPipelineConfig
    """LeRobot's."""
    learnt: MemoryDataset
    held_out: MemoryDataset | None
    """Episodes on which the loss is measured."""
    checkpoint: Path | None
    """The checkpoint to go on from; None to begin."""
    meta: Callable[[int], PolicyMeta]
    """Describes the policy after so many updates."""
    losses: dict[int, float]
    """On the held-out episodes, by update: as they are measured."""
    eval_steps: int
    """Updates between two measurements."""
    plateau: Plateau | None = None
    """Ends the training where that loss is flat; None makes all updates."""
    quiet: bool = False
    """Whether to show no progress."""

    def train(self) -> None:
        """Train to the end; one of the processes writes checkpoints and the curve, and shows the progress.

        Raises:
            KeyboardInterrupt: it was interrupted; the update is finished, and its checkpoint written.
        """
        learner = build_learner(self.settings, self.learnt.meta, self.checkpoint, self.plateau)
        main, folder = learner.accelerator.is_main_process, self.settings.output_dir
        curve = Curve(folder, learner.step) if main and folder else None
        columns = TextColumn("training"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
        loss, shown = TextColumn("{task.description}"), main and not self.quiet
        with (
            Progress(*columns, loss, console=Terminal(stderr=True), disable=not shown) as progress,
            Interrupts() as interrupts,
            interrupts.deferred(),
        ):
            self._loop(learner, curve, progress, interrupts)
        learner.accelerator.end_training()

    def _loop(
        self, learner: Learner, curve: Curve | None, progress: Progress, interrupts: Interrupts
    ) -> None:
        settings, means = self.settings, self._means(learner)
        assert settings.optimizer is not None
        around = settings.optimizer.grad_clip_norm, learner.accelerator, learner.schedule
        batches = self._batches(learner)
        bar = progress.add_task("", total=self._end, completed=learner.step)
        step, ends = learner.step, False
        while step < self._end and not ends:
            step += 1
            began = time.perf_counter()
            batch = learner.before(next(batches))
            means.dataloading_s = time.perf_counter() - began
            update_policy(means, learner.policy, batch, learner.optimizer, *around)
            means.step()
            progress.advance(bar)
            if step % settings.log_freq == 0:
                means.reduce_across_ranks()
                if curve is not None:
                    curve.add(row := means.to_dict() | {"step": step})
                    progress.update(bar, description=f"loss {row['loss']:.4f}")
                means.reset_averages()
            if self.held_out and (step % self.eval_steps == 0 or step == self._end):
                loss = learner.loss_on(self.held_out, settings.batch_size)
                if not math.isfinite(loss):
                    words = f"got {loss} after {step} updates"
                    raise HandrailError(f"training: expected a finite loss on held-out episodes, {words}")
                self.losses[step] = loss
                progress.update(bar, total=self._end)
            ends = interrupts.asked
            if ends or should_save_checkpoint(step, settings.save_freq, self._end):
                if learner.accelerator.is_main_process:
                    self._save(learner, step, means)
                if not ends:  # of other processes' interrupts this one does not know
                    learner.accelerator.wait_for_everyone()

    @property
    def _end(self) -> int:
        """The last update, as far as is known now."""
        return self.plateau.end if self.plateau else self.settings.steps

    def _means(self, learner: Learner) -> MetricsTracker:
        meters = {name: AverageMeter(name, reduction=how) for name, how in _OVER_PROCESSES.items()}
        for name, (total, count) in read_sums(self.checkpoint).items():
            meters[name].sum, meters[name].count = total, count
        sizes = self.settings.batch_size, len(self.learnt), len(self.learnt.meta.lengths)
        accelerator: Any = learner.accelerator
        return MetricsTracker(*sizes, meters, learner.step, accelerator)

    def _batches(self, learner: Learner) -> Iterator[Any]:
        """Yield batches for ever, from where a training that was cut off would have gone on, to the bit."""
        settings, episodes, accelerator = self.settings, self.learnt.meta.episodes, learner.accelerator
        processes = accelerator.num_processes
        sampler = EpisodeAwareSampler(
            episodes["dataset_from_index"],
            episodes["dataset_to_index"],
            drop_n_last_frames=getattr(settings.policy, "drop_n_last_frames", 0),
            shuffle=True,
            seed=settings.seed or 0,
        )
        state = compute_sampler_state(learner.step, len(sampler), settings.batch_size, processes)
        sampler.load_state_dict(state)
        order: Any = BatchSampler(sampler, settings.batch_size, drop_last=False)
        if processes > 1:
            order = BatchSamplerShard(order, processes, accelerator.process_index)
        while True:
            for indices in order:
                yield send_to_device(self.learnt.batch(indices), accelerator.device)

    def _save(self, learner: Learner, step: int, means: MetricsTracker) -> None:
        assert self.settings.output_dir is not None
        folder = get_step_checkpoint_dir(self.settings.output_dir, self.settings.steps, step)
        draft = folder.with_name(f".{folder.name}")
        shutil.rmtree(draft, ignore_errors=True)
        meta, accelerator = self.meta(step), learner.accelerator
        completion = Completion(meta.robot, meta.environment, meta.mode, meta.fps)
        around = with_steps(learner.before, learner.after, meta.interface, completion)
        parts = (accelerator.unwrap_model(learner.policy), learner.optimizer, learner.schedule, *around)
        sizes = accelerator.num_processes, self.settings.batch_size
        save_checkpoint(draft, step, self.settings, *parts, *sizes)
        write_sums(draft, means.metrics)
        write_meta(draft / MODEL, meta)
        publish_folder(draft, folder)
        point_to(folder)
