"""Means over units."""

from typing import Any

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.statistics.contrast import Measure, Value
from handrail.datasets.statistics.resampling import FEWEST, bootstrap_mean


def mean_value(
    measure: Measure, label: str, values: FloatArray, rng: np.random.Generator | None, **more: Any
) -> Value:
    """Return the mean of a measure over the units that have a value, NaN where one has none.

    Its interval is there for five or more, and if there is an `rng` to resample them.
    """
    known = values[np.isfinite(values)]
    return Value(
        measure=measure,
        label=label,
        values=values,
        estimate=float(known.mean()) if len(known) else None,
        interval=bootstrap_mean(known, rng) if rng and len(known) >= FEWEST else None,
        counts=(len(known),),
        **more,
    )
