"""Array types and the read-only copy that every value in the house is made of."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.floating]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.integer]


def frozen(values: ArrayLike, dtype: Any = np.float64) -> NDArray[Any]:
    """Return a read-only copy of the values."""
    array = np.array(values, dtype=dtype)
    array.setflags(write=False)
    return array
