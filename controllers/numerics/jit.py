"""How the inner loops of an update become machine code."""

from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from numba.core import event

from handrail.controllers.numerics.first_use import compiling

_SUMS = {"reassoc", "contract", "nsz"}  # sums may be reordered, so that they run on vectors; NaN stays NaN


def jit(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function of numbers and arrays at its first call; the machine code is kept on disk."""
    return _compiled(function, fastmath=_SUMS)


def exact_jit(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function without reordering anything, so that it returns numpy's numbers."""
    return _compiled(function)


def _compiled(function: Callable[..., Any], **options: Any) -> Callable[..., Any]:
    options["error_model"] = "numpy"
    try:
        return numba.njit(cache=True, **options)(function)
    except RuntimeError:  # no folder to keep it in: compiled anew in every process
        return numba.njit(**options)(function)


class _FirstUse(event.Listener):
    """Hears numba compile what is not in its cache."""

    def on_start(self, event: event.Event) -> None:
        compiling()

    def on_end(self, event: event.Event) -> None:
        pass


event.register("numba:compile", _FirstUse())


@exact_jit
def are_finite(values):
    """Whether all values are finite numbers, (n,); many times faster than numpy's own of so few."""
    finite = True
    for value in values:
        finite &= np.isfinite(value)
    return finite


@exact_jit
def bounded(values, limit):
    """Return finite values within ± limit, (n,) both."""
    result = np.empty(len(values))
    for index in range(len(values)):
        result[index] = min(max(values[index], -limit[index]), limit[index])
    return result


@jit
def copy(source, count, target):
    """Copy the first entries of a row; a loop compiles much faster than numba's own assignment."""
    for t in range(count):
        target[t] = source[t]
