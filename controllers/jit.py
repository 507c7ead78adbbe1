"""How the inner loops of an update become machine code."""

from collections.abc import Callable
from typing import Any

import numba

_SUMS = {"reassoc", "contract", "nsz"}  # sums may be reordered, so that they run on vectors; NaN stays NaN


def jit(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function of numbers and arrays at its first call; the machine code is kept on disk."""
    return numba.njit(cache=True, fastmath=_SUMS, error_model="numpy")(function)
