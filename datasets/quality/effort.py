"""How much work steering was: what the operator put in, by axis.

Inputs of different kinds are made comparable by their scale, the largest value of each axis in all datasets
that are compared: 1 is full deflection. Measures: Herlant et al. 2016, "Assistive teleoperation of robot
arms via automatic time-optimal mode switching", for mode switches; the others are common in teleoperation.
"""

import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.datasets.quality.missing import DoesNotApply

DEAD_BAND = 0.05  # of full deflection: below it an axis is not in use


def input_effort(inputs: FloatArray, scale: FloatArray, fps: float) -> float:
    """Return Σ_i ∫ |u_i| / scale_i dt: seconds of full deflection, axes added up [s].

    Args:
        inputs: `(N, u)`.
        scale: Largest |u| of each axis, `(u,)`; an axis with 0 was never used and does not count.
        fps: Frames a second [Hz].
    """
    return float(np.abs(_deflection(inputs, scale)).sum()) / fps


def input_reversals(inputs: FloatArray, scale: FloatArray) -> float:
    """Return how often an axis changed its sign, axes added up; what is below 5 % of full is passed over.

    Args:
        inputs: `(N, u)`.
        scale: Largest |u| of each axis, `(u,)`.
    """
    deflection = _deflection(inputs, scale)
    signs = np.where(np.abs(deflection) >= DEAD_BAND, np.sign(deflection), 0.0)
    return float(sum(np.count_nonzero(np.diff(axis[axis != 0])) for axis in signs.T))


def active_axes(inputs: FloatArray, scale: FloatArray) -> float:
    """Return the mean number of axes that are above 5 % of full deflection at a time.

    Args:
        inputs: `(N, u)`.
        scale: Largest |u| of each axis, `(u,)`.
    """
    return float((np.abs(_deflection(inputs, scale)) >= DEAD_BAND).sum(axis=1).mean())


def mode_switches(mode: np.ndarray | None, owned: BoolArray | None) -> float:
    """Return how often the mode, or the set of axes that the operator owns, changed.

    Args:
        mode: Names, `(N,)`, or None.
        owned: `(N, u)`, or None.

    Raises:
        DoesNotApply: Neither was recorded.
    """
    changed = []
    if mode is not None:
        changed.append(mode[1:] != mode[:-1])
    if owned is not None:
        changed.append((owned[1:] != owned[:-1]).any(axis=1))
    if not changed:
        raise DoesNotApply("no column of the mode or of the axes that the operator owned")
    return float(np.count_nonzero(np.any(changed, axis=0)))


def _deflection(inputs: FloatArray, scale: FloatArray) -> FloatArray:
    used = scale > 0
    if not used.any():
        raise DoesNotApply("no input axis was ever used")
    return inputs[:, used] / scale[used]
