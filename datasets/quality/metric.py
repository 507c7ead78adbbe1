"""A quality metric: what it is called, its unit, what it means, and how it is measured."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.quality.pool import ObservationPool, Sample
from handrail.datasets.reading.demonstration import Demonstration
from handrail.datasets.statistics.contrast import Measure

Needs = Literal["", "motion", "position", "action", "controller", "pool"]
OfEpisode = Callable[[Demonstration, ObservationPool], float]
OfGroup = Callable[[Sample, ObservationPool, np.random.Generator], FloatArray]


@dataclass(frozen=True)
class Metric(Measure):
    """A measure of quality.

    Attributes:
        needs: What its unit hangs on, see `units.why_not`; "" where it has a unit of its own; "pool" for
            whatever looks at more of the pool than its margin.
        measure: Its value for one episode, or None.
        measure_group: Its values for frames that stand for a dataset, for what needs the other episodes; or
            None. Such values depend on how many there are and, through shared neighbours, on each other.
    """

    needs: Needs = ""
    measure: OfEpisode | None = None
    measure_group: OfGroup | None = None

    @property
    def of_group(self) -> bool:
        """Whether an episode's value depends on the other episodes of its group."""
        return self.measure_group is not None


def metric(
    name: str, unit: str, good: str, meaning: str, needs: Needs = "", title: str = ""
) -> Callable[[OfEpisode], Metric]:
    """Return what makes a metric of the function that measures it; its title is its name if not given."""
    called = title or name.replace("_", " ")
    return lambda measure: Metric(name, called, unit, good, meaning, needs, measure)
