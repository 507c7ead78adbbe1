"""LeRobot's training, run inside this process with our data, our checkpoints and without its pages of logs.

Nothing of LeRobot is edited: while it trains, a few names that its script looks up lead here instead.
"""

import logging
import shutil
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

import torch
from lerobot.common import train_utils
from lerobot.configs.train import TrainPipelineConfig
from lerobot.optim.factory import make_optimizer_and_scheduler
from lerobot.scripts import lerobot_train
from lerobot.utils.logging_utils import MetricsTracker

from handrail.datasets.storage.atomic import publish_folder
from handrail.policies.imitation.interface.checkpoint import MODEL, point_to
from handrail.policies.imitation.training.curve import Bar, Curve, Watch
from handrail.policies.imitation.training.memory import MemoryDataset


@dataclass
class Pipeline(TrainPipelineConfig):
    """LeRobot's settings of a training, whose folder is ours to check and whose schedule may be given."""

    def validate(self) -> None:
        """Fill in what follows from the policy."""
        folder, self.output_dir = self.output_dir, None
        schedule = self.scheduler
        super().validate()
        self.output_dir = folder
        assert self.policy is not None
        self.optimizer = self.policy.get_optimizer_preset()
        self.scheduler = schedule or self.policy.get_scheduler_preset()


@dataclass(frozen=True)
class Run:
    """One call of LeRobot's training.

    Attributes:
        pipeline: its settings.
        dataset: what it learns from.
        checkpoint: the checkpoint to go on from; None to begin.
        finish: called with the `pretrained_model` folder of every new checkpoint and its step.
        quiet: whether to show no progress.
    """

    pipeline: Pipeline
    dataset: MemoryDataset
    checkpoint: Path | None
    finish: Callable[[Path, int], None]
    quiet: bool = False

    def train(self) -> Curve | None:
        """Train to the end; return the curve of the loss in the process that writes it."""
        watches: list[Watch] = []
        try:
            with self._substituted(watches):
                lerobot_train.train.__wrapped__(self.pipeline)  # pyright: ignore[reportFunctionMemberAccess]
        finally:
            for watch in watches:
                watch.bar.close()
        return watches[0].curve

    @contextmanager
    def _substituted(self, watches: list[Watch]) -> Iterator[None]:
        arguments = [] if self.checkpoint is None else [f"--config_path={self.checkpoint / MODEL}"]
        names: dict[str, Any] = {
            "make_train_eval_datasets": lambda _: (self.dataset, None),
            "make_optimizer_and_scheduler": _fused,
            "save_checkpoint": self._save,
            "update_last_checkpoint": point_to,
            "MetricsTracker": self._tracker(watches),
            "tqdm": lambda **_: _Silent(),
            "cycle": _endless,
            "init_logging": lambda **_: None,
            "logging": logging.getLogger("lerobot.training"),
        }
        with patch.multiple(lerobot_train, **names), patch.object(sys, "argv", [sys.argv[0], *arguments]):
            yield

    def _save(self, checkpoint_dir: Path, step: int, **rest: Any) -> None:
        draft = checkpoint_dir.with_name(f".{checkpoint_dir.name}")
        shutil.rmtree(draft, ignore_errors=True)
        train_utils.save_checkpoint(checkpoint_dir=draft, step=step, **rest)
        self.finish(draft / MODEL, step)
        publish_folder(draft, checkpoint_dir)

    def _tracker(self, watches: list[Watch]) -> type[MetricsTracker]:
        folder, total, quiet = self.pipeline.output_dir, self.pipeline.steps, self.quiet
        assert folder is not None

        class Tracker(MetricsTracker):
            """LeRobot's means, shown and written down whenever it would print them."""

            def __init__(self, *arguments: Any, initial_step: int, accelerator: Any, **rest: Any) -> None:
                super().__init__(*arguments, initial_step=initial_step, accelerator=accelerator, **rest)
                main = accelerator.is_main_process
                curve = Curve(folder, initial_step) if main else None
                watches.append(Watch(curve, Bar(initial_step, total, shown=main and not quiet)))

            def step(self) -> None:
                super().step()
                watches[0].bar.advance()

            def reset_averages(self) -> None:
                row = self.to_dict()
                watches[0].see(row | {"step": row["steps"]})
                super().reset_averages()

        return Tracker


class _Silent:
    """In the place of LeRobot's progress bar."""

    def update(self, steps: int) -> None:
        """Count nothing."""

    def close(self) -> None:
        """Close nothing."""


def _fused(pipeline: Pipeline, policy: Any) -> tuple[Any, Any]:
    """Return LeRobot's optimizer and schedule; Adam updates all weights in one call."""
    optimizer, scheduler = make_optimizer_and_scheduler(pipeline, policy)
    if isinstance(optimizer, torch.optim.Adam):
        for group in optimizer.param_groups:
            group["fused"], group["foreach"] = True, False
    return optimizer, scheduler


def _endless(loader: Any) -> Iterator[Any]:
    """Yield batches for ever, so that a training that was cut off goes on as if it had not been, to the bit.

    Accelerate would set LeRobot's sampler back to the first epoch, and PyTorch draws a number when a loader
    begins, which would change what is random in the policy.
    """
    batches = getattr(loader.batch_sampler, "batch_sampler", loader.batch_sampler)  # a share of it, or all
    loader.iteration = batches.sampler.state_dict()["epoch"]
    while True:
        state = torch.get_rng_state()
        batches = iter(loader)
        batch = next(batches)
        torch.set_rng_state(state)
        yield batch
        yield from batches
