"""The loop of a training: LeRobot's update, over our data in LeRobot's order, into our checkpoints."""

import shutil
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from accelerate import Accelerator
from accelerate.data_loader import BatchSamplerShard
from accelerate.utils import send_to_device
from lerobot.common.train_utils import get_step_checkpoint_dir, save_checkpoint, should_save_checkpoint
from lerobot.configs.train import TrainPipelineConfig
from lerobot.datasets.sampler import EpisodeAwareSampler, compute_sampler_state
from lerobot.scripts.lerobot_train import update_policy
from lerobot.utils.logging_utils import AverageMeter, MetricsTracker
from lerobot.utils.random_utils import set_seed
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from torch.utils.data import BatchSampler

from handrail.controllers.interrupts import Interrupts
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.storage.atomic import publish_folder
from handrail.policies.imitation.interface.checkpoint import MODEL, point_to
from handrail.policies.imitation.interface.completion import Completion
from handrail.policies.imitation.interface.interface import PolicyInterface
from handrail.policies.imitation.interface.steps import with_steps
from handrail.policies.imitation.training.curve import COLUMNS, Curve, read_sums, write_sums
from handrail.policies.imitation.training.learner import Learner, build_accelerator, build_learner
from handrail.policies.imitation.training.memory import MemoryDataset
from handrail.policies.imitation.training.plateau import Plateau
from handrail.policies.imitation.training.validation import Validation

_OVER_PROCESSES = {
    **{"loss": "mean", "grad_norm": "none", "lr": "none"},
    **{"update_s": "max", "dataloading_s": "max", "gpu_mem_gb": "max"},
}


@dataclass(frozen=True)
class TrainingRun:
    """One training, from its beginning or from a checkpoint.

    Attributes:
        settings: LeRobot's.
        dataset: what it learns from.
        checkpoint: the checkpoint to go on from; None to begin.
        finish: called with the `pretrained_model` folder of every new checkpoint and its step.
        quiet: whether to show no progress.
        interface: what the policy reads and writes, for the checkpoints; None if that is what was recorded.
        completion: what completes its intents.
        validation: measures the loss on held-out episodes; None without any.
        plateau: ends the training where that loss is flat; None makes all updates.
    """

    settings: TrainPipelineConfig
    dataset: MemoryDataset
    checkpoint: Path | None
    finish: Callable[[Path, int], None]
    quiet: bool = False
    interface: PolicyInterface | None = None
    completion: Completion | None = None
    validation: Validation | None = None
    plateau: Plateau | None = None

    def train(self) -> None:
        """Train to the end; one of the processes writes checkpoints and the curve, and shows the progress.

        Raises:
            HandrailError: accelerate would split the model between processes, or the loss is not finite.
            KeyboardInterrupt: it was interrupted; the update is finished, and its checkpoint written.
        """
        settings, accelerator = self.settings, build_accelerator(self.settings.policy)
        assert settings.output_dir is not None
        set_seed(settings.seed, accelerator)  # pyright: ignore[reportArgumentType]
        learner = build_learner(settings, self.dataset.meta, self.checkpoint, accelerator, self.plateau)
        main = accelerator.is_main_process
        curve = Curve(settings.output_dir, learner.step) if main else None
        columns = TextColumn("training"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
        told, shown = TextColumn("{task.description}"), main and not self.quiet
        with (
            Progress(*columns, told, console=Terminal(stderr=True), disable=not shown) as progress,
            Interrupts() as interrupts,
            interrupts.deferred(),
        ):
            self._loop(learner, accelerator, curve, progress, interrupts)
        accelerator.end_training()

    def _loop(
        self,
        learner: Learner,
        accelerator: Accelerator,
        curve: Curve | None,
        progress: Progress,
        interrupts: Interrupts,
    ) -> None:
        settings, means = self.settings, self._means(learner.step, accelerator)
        assert settings.optimizer is not None
        around = settings.optimizer.grad_clip_norm, accelerator, learner.schedule
        batches = self._batches(learner.step, accelerator)
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
            if self.validation and (step % self.validation.every == 0 or step == self._end):
                self.validation.measure(step, learner, accelerator, settings.batch_size)
                progress.update(bar, total=self._end)
            ends = interrupts.asked
            if ends or should_save_checkpoint(step, settings.save_freq, self._end):
                if accelerator.is_main_process:
                    self._save(learner, step, accelerator, means)
                if not ends:  # of other processes' interrupts this one does not know
                    accelerator.wait_for_everyone()

    @property
    def _end(self) -> int:
        """The last update, as far as is known now."""
        return self.plateau.end if self.plateau else self.settings.steps

    def _means(self, step: int, accelerator: Accelerator) -> MetricsTracker:
        meters = {name: AverageMeter(name, reduction=how) for name, how in _OVER_PROCESSES.items()}
        for name, (total, count) in read_sums(self.checkpoint).items():
            meters[name].sum, meters[name].count = total, count
        sizes = self.settings.batch_size, len(self.dataset), len(self.dataset.meta.lengths)
        return MetricsTracker(*sizes, meters, step, accelerator)  # pyright: ignore[reportArgumentType]

    def _batches(self, step: int, accelerator: Accelerator) -> Iterator[Any]:
        """Yield batches for ever, from where a training that was cut off would have gone on, to the bit."""
        settings, processes = self.settings, accelerator.num_processes
        sampler = EpisodeAwareSampler(
            self.dataset.meta.episodes["dataset_from_index"],
            self.dataset.meta.episodes["dataset_to_index"],
            drop_n_last_frames=getattr(settings.policy, "drop_n_last_frames", 0),
            shuffle=True,
            seed=settings.seed or 0,
        )
        sampler.load_state_dict(compute_sampler_state(step, len(sampler), settings.batch_size, processes))
        order: Any = BatchSampler(sampler, settings.batch_size, drop_last=False)
        if processes > 1:
            order = BatchSamplerShard(order, processes, accelerator.process_index)
        while True:
            for indices in order:
                yield send_to_device(self.dataset.batch(indices), accelerator.device)

    def _save(self, learner: Learner, step: int, accelerator: Accelerator, means: MetricsTracker) -> None:
        assert self.settings.output_dir is not None
        folder = get_step_checkpoint_dir(self.settings.output_dir, self.settings.steps, step)
        draft = folder.with_name(f".{folder.name}")
        shutil.rmtree(draft, ignore_errors=True)
        policy, processes = accelerator.unwrap_model(learner.policy), accelerator.num_processes
        around = with_steps(learner.before, learner.after, self.interface, self.completion)
        parts = (policy, learner.optimizer, learner.schedule, *around)
        save_checkpoint(draft, step, self.settings, *parts, processes, self.settings.batch_size)
        meters = {name: means.metrics[name] for name in COLUMNS if name in means.metrics}
        write_sums(draft, {name: (meter.sum, meter.count) for name, meter in meters.items()})
        self.finish(draft / MODEL, step)
        publish_folder(draft, folder)
        point_to(folder)
