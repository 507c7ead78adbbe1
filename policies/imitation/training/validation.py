"""The loss on episodes that a policy does not learn from."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
from accelerate import Accelerator
from accelerate.utils import send_to_device

from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.training.learner import Learner
from handrail.policies.imitation.training.memory import MemoryDataset

_FRAMES = 2048  # at most, spread evenly: a measurement takes as long as some twenty updates
_SEED = 0  # of what a policy draws to compute its loss: the same for every measurement


@dataclass(frozen=True)
class Validation:
    """Measures the loss on held-out episodes.

    Attributes:
        dataset: these episodes.
        every: updates between two measurements.
        losses: by update, as they are measured.
    """

    dataset: MemoryDataset
    every: int
    losses: dict[int, float] = field(default_factory=dict)

    def measure(self, step: int, learner: Learner, accelerator: Accelerator, batch_size: int) -> float:
        """Measure the loss after an update, the same in every process; what is random goes on as before."""
        policy = accelerator.unwrap_model(learner.policy)
        policy.eval()
        with torch.random.fork_rng(), torch.no_grad(), accelerator.autocast():
            torch.manual_seed(_SEED)
            losses = [
                policy.forward(learner.before(batch))[0].item() * len(indices)
                for indices in self._batches(batch_size)
                for batch in (send_to_device(self.dataset.batch(indices), accelerator.device),)
            ]
        policy.train()
        mean: Any = torch.tensor(sum(losses) / len(self._frames), device=accelerator.device)
        reduced: Any = accelerator.reduce(mean, reduction="mean")
        loss = float(reduced)
        if not np.isfinite(loss):
            raise HandrailError(
                f"training: expected a finite loss on held-out episodes, got {loss} after {step} updates"
            )
        self.losses[step] = loss
        return loss

    @property
    def _frames(self) -> list[int]:
        count = len(self.dataset)
        return np.unique(np.linspace(0, count - 1, min(count, _FRAMES)).round().astype(int)).tolist()

    def _batches(self, size: int) -> list[Sequence[int]]:
        frames = self._frames
        return [frames[start : start + size] for start in range(0, len(frames), size)]
