"""An operator who sees what was some time ago."""

from collections import deque
from dataclasses import replace

import numpy as np

from handrail.collect.operators.operator import EpisodeEvent, Operator, View
from handrail.controllers.interface.intent import Intent


class DelayedOperator:
    """Shows another operator each moment k control periods late; an operator.

    What they ask for arrives at once: the intent carries the time at which it was asked. Before the k-th
    period they see the beginning.

    Args:
        operator: whoever steers.
        periods: k, 0 or more.
    """

    def __init__(self, operator: Operator, periods: int) -> None:
        self._operator, self._periods = operator, periods

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin an episode."""
        self._views = deque([view] * self._periods)
        self._operator.reset(view, rng)

    def act(self, view: View) -> Intent | EpisodeEvent:
        """Return what is asked for now, after what was seen k periods ago."""
        self._views.append(view)
        asked = self._operator.act(self._views.popleft())
        return asked if isinstance(asked, EpisodeEvent) else replace(asked, time=view.state.time)
