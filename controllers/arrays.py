"""Array types, and the checked, read-only copy that every value in the house is made of."""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from handrail.controllers.errors import HandrailError, shown

FloatArray = NDArray[np.floating]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.integer]

_FLOAT = np.dtype(np.float64)
_KINDS = {"f": "biuf", "i": "biu", "b": "b"}  # of numbers that may become floats, integers, truth values
_WORDS = {"f": "real numbers", "i": "integers", "b": "True or False"}


def frozen(values: ArrayLike, dtype: Any = np.float64, what: str = "an array") -> NDArray[Any]:
    """Return a read-only copy of the values; these themselves where they are read-only and own their memory.

    Args:
        values: numbers; truth values where `dtype` is bool.
        dtype: of the copy.
        what: they are, for the message.
    """
    if type(values) is np.ndarray and values.dtype is _FLOAT and dtype is np.float64:
        if values.base is None and not values.flags.writeable:
            return values
        array = values.copy()  # what nearly all are, and many in an update
    else:
        if not (isinstance(values, np.ndarray) and values.dtype == dtype):
            values = _checked(values, np.dtype(dtype).kind, what)
        array = np.array(values, dtype=dtype)
    array.setflags(write=False)
    return array


def are_finite(values: FloatArray) -> bool:
    """Whether all values are finite numbers, (n,); where they are, their squares mostly say so at once."""
    return math.isfinite(values.dot(values)) or bool(np.isfinite(values).all())


def real(value: Any, what: str) -> float:
    """Return a number as a float."""
    if isinstance(value, float):
        return float(value)
    array = _checked(value, "f", what)
    if array.shape != ():
        raise HandrailError(f"{what}: expected one number, got shape {array.shape}")
    return float(array)


def _checked(values: ArrayLike, kind: str, what: str) -> NDArray[Any]:
    try:
        array = np.asarray(values)
    except (ValueError, OverflowError) as error:
        raise HandrailError(f"{what}: expected {_WORDS[kind]} in rows of equal length: {error}") from error
    if array.size and array.dtype.kind not in _KINDS[kind]:
        raise HandrailError(f"{what}: expected {_WORDS[kind]}, got {shown(values)}")
    return array
