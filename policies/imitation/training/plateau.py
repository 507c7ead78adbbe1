"""A training that ends by itself: the loss on held-out episodes is flat, and the learning rate has fallen.

The rate rises over the first updates, stays, and falls to zero in a straight line over the last fifth. That
begins where the loss is flat, or so that the training ends with the most updates that it may have.
"""

from collections.abc import Mapping
from dataclasses import dataclass

_STAYS = 0.8  # of all updates, before the rate falls


@dataclass(frozen=True)
class Plateau:
    """When a loss is flat, and what follows from that."""

    losses: Mapping[int, float]  # on held-out episodes by update; grows while the training goes on
    patience: int  # measurements that a loss may take to become better
    improvement: float  # share by which it has to
    most: int  # updates of the whole training
    warmup: int  # updates in which the learning rate rises

    @property
    def flat(self) -> int | None:
        """The first update at which the loss was flat; None before there is one.

        min(l_{k−m+1} … l_k) > (1 − x) min(l_1 … l_{k−m}) of the measurements l, m the patience, x the
        improvement.
        """
        steps = sorted(self.losses)
        values = [self.losses[step] for step in steps]
        for last in range(self.patience + 1, len(steps) + 1):
            before, lately = min(values[: last - self.patience]), min(values[last - self.patience : last])
            if lately > before - self.improvement * abs(before):
                return steps[last - 1]
        return None

    @property
    def falls(self) -> int:
        """The update after which the learning rate falls, as far as is known now."""
        latest = max(1, int(_STAYS * self.most))
        return min(self.flat or latest, latest)

    @property
    def end(self) -> int:
        """The last update, as far as is known now."""
        return min(self.most, max(self.falls + 1, round(self.falls / _STAYS)))

    def rate(self, step: int) -> float:
        """Return the learning rate after so many updates, as a share of the highest."""
        falls, end = self.falls, self.end
        rise = min(1.0, (step + 1) / max(1, self.warmup))
        return rise * min(1.0, max(0.0, (end - step) / max(1, end - falls)))
