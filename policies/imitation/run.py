"""LeRobot's training, run inside this process with our data, our checkpoints and without its pages of logs.

Nothing of LeRobot is edited: while `training_with` is entered, a few names that its script looks up lead here.
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
from lerobot.optim.schedulers import CosineAnnealingWithWarmupSchedulerConfig
from lerobot.scripts import lerobot_train
from lerobot.utils.logging_utils import MetricsTracker

from handrail.policies.imitation.checkpoint import MODEL, point_to, publish
from handrail.policies.imitation.curve import Bar, Curve
from handrail.policies.imitation.memory import MemoryDataset

_WARMUP = 500  # updates in which the learning rate rises, or a tenth of all if that is fewer


@dataclass
class Pipeline(TrainPipelineConfig):
    """LeRobot's settings of a training, whose folder is ours to check."""

    cosine: bool = False

    def validate(self) -> None:
        """Fill in what follows from the policy."""
        folder, self.output_dir = self.output_dir, None
        super().validate()
        self.output_dir = folder
        assert self.policy is not None
        self.optimizer = self.policy.get_optimizer_preset()
        self.scheduler = self.policy.get_scheduler_preset()
        if self.cosine:
            warmup = min(_WARMUP, self.steps // 10)
            self.scheduler = CosineAnnealingWithWarmupSchedulerConfig(num_warmup_steps=warmup)


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

    def train(self) -> Curve:
        """Train to the end; return the curve of the loss."""
        curves: list[Curve] = []
        with self._substituted(curves):
            lerobot_train.train.__wrapped__(self.pipeline)  # pyright: ignore[reportFunctionMemberAccess]
        return curves[0]

    @contextmanager
    def _substituted(self, curves: list[Curve]) -> Iterator[None]:
        arguments = [] if self.checkpoint is None else [f"--config_path={self.checkpoint / MODEL}"]
        names: dict[str, Any] = {
            "make_train_eval_datasets": lambda _: (self.dataset, None),
            "make_optimizer_and_scheduler": _fused,
            "save_checkpoint": self._save,
            "update_last_checkpoint": point_to,
            "MetricsTracker": self._tracker(curves),
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
        publish(draft, checkpoint_dir)

    def _tracker(self, curves: list[Curve]) -> type[MetricsTracker]:
        folder, total, quiet = self.pipeline.output_dir, self.pipeline.steps, self.quiet
        assert folder is not None

        class Tracker(MetricsTracker):
            """LeRobot's means, written down whenever it would print them."""

            def __init__(self, *arguments: Any, initial_step: int, accelerator: Any, **rest: Any) -> None:
                super().__init__(*arguments, initial_step=initial_step, accelerator=accelerator, **rest)
                main = accelerator.is_main_process
                self.__dict__["curve"] = Curve(folder, initial_step) if main else None
                self.__dict__["bar"] = Bar(initial_step, total, shown=main and not quiet)
                curves.append(self.curve)

            def step(self) -> None:
                super().step()
                self.bar.update()
                if self.steps == total:
                    self.bar.close()

            def reset_averages(self) -> None:
                if self.curve is not None:
                    self.curve.add(self.to_dict() | {"step": self.steps})
                    self.bar.say(self.loss.avg)
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
    """Yield batches for ever; that one begins anew must not change what is random in the policy.

    So a training that was cut off and goes on is the same, to the bit, as one that was not.
    """
    while True:
        state = torch.get_rng_state()
        batches = iter(loader)
        batch = next(batches)
        torch.set_rng_state(state)
        yield batch
        yield from batches
