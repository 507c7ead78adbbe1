"""An operator who sees what was some time ago."""

from collections import deque
from dataclasses import replace

import numpy as np

from handrail.collect.operators.operator import Operator, View
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
        self._operator = operator
        self._periods = periods

    @property
    def name(self) -> str:
        """Who steers."""
        return self._operator.name

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin an episode."""
        self._views = deque([view] * self._periods)
        self._operator.reset(view, rng)

    def act(self, view: View) -> Intent:
        """Return what is asked for now, after what was seen k periods ago."""
        self._views.append(view)
        return replace(self._operator.act(self._views.popleft()), time=view.state.time)
