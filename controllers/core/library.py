"""The compiled core as Python sees it: its functions, and its structures with their arrays."""

import ctypes
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import CodeType
from typing import Any

import numpy as np

from handrail.controllers.core import building
from handrail.controllers.errors import HandrailError, message_of

_HEADER = (Path(__file__).parent / "core.h").read_text()
_FIELD = re.compile(r"  (int64_t|double) (\*?)(\w+);(?:\s*/\* \(([^)]*)\))?")
_MEMBER = re.compile(r"  (int|void) \(\*(\w+)\)")
_PROTOTYPE = re.compile(r"^(void|int64_t|double) (\w+)\(([^)]*)\);", re.MULTILINE)
_NUMBER = {"int64_t": (ctypes.c_int64, np.int64), "double": (ctypes.c_double, np.float64)}
_NUMBERS = ctypes.POINTER(ctypes.c_double)
_NOTHING = ctypes.c_char * 0
_CALLBACK = {
    "void": ctypes.PYFUNCTYPE(None),
    "int": ctypes.PYFUNCTYPE(ctypes.c_int, ctypes.c_int64, _NUMBERS, _NUMBERS),
}


class Pointer:
    """An array that C is given many times: its address is looked up once."""

    def __init__(self, array: np.ndarray) -> None:
        self.array, self.address = array, _Address.from_param(array)


class _Address:
    """What C takes as a pointer: an array of its numbers, a structure, or None."""

    @classmethod
    def from_param(cls, value: Any) -> Any:
        if isinstance(value, np.ndarray):
            flags = value.flags
            if not (flags.c_contiguous and value.dtype.char in "dl"):
                raise TypeError(f"core: expected float64 or int64 in one piece, got {value.dtype}")
            if flags.writeable:  # takes a third of the time
                return ctypes.byref(_NOTHING.from_buffer(value))
            return ctypes.c_void_p(value.ctypes.data)
        return None if value is None else value.address


@cache
def functions() -> ctypes.PyDLL:
    """Return the functions of core.h; the library is built first where a clone lacks it."""
    try:
        loaded = ctypes.PyDLL(str(building.build()))
    except OSError as error:
        raise HandrailError(message_of(error)) from error
    for kind, name, arguments in _PROTOTYPE.findall(_HEADER):
        function = getattr(loaded, name)
        function.restype = None if kind == "void" else _NUMBER[kind][0]
        parts = [part.split() for part in arguments.split(",")]
        function.argtypes = [_Address if "*" in part[-1] else _NUMBER[part[0]][0] for part in parts]
    return loaded


def constant(name: str) -> float:
    """Return a number that core.h defines."""
    found = re.search(rf"^#define {name} (\S+)", _HEADER, re.MULTILINE)
    assert found, name
    return float(found[1])


class Memory:
    """A structure of core.h; its arrays are attributes, made here or given.

    Args:
        name: of the structure.
        sizes: the letters of core.h.
        given: arrays that somebody else owns.
    """

    def __init__(self, name: str, sizes: dict[str, int], given: dict[str, np.ndarray] | None = None) -> None:
        structure, layout = _layout(name)
        arrays = dict(given or {})
        for label, (number, shape) in layout.items():
            if label not in arrays:
                arrays[label] = np.zeros(eval(shape, dict(sizes)), number)
        self.fields = structure()
        self.address = ctypes.byref(self.fields)
        for label, size in sizes.items():
            setattr(self.fields, label, size)
        for label, array in arrays.items():
            setattr(self.fields, label, array.ctypes.data)
        self.__dict__.update(arrays)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.fields, name)

    def call_back(self, name: str, function: Callable[..., Any]) -> None:
        """Let C call a Python function."""
        kind = type(getattr(self.fields, name))
        setattr(self.fields, name, kind(function))


@cache
def _layout(name: str) -> tuple[type[ctypes.Structure], dict[str, tuple[type, CodeType]]]:
    """Return a structure of core.h, and the numbers and the shape of each of its arrays."""
    body = re.search(rf"typedef struct {{\n((?:(?!typedef).)*?)\n}} {name};", _HEADER, re.DOTALL)
    assert body, name
    fields: list[tuple[str, Any]] = []
    arrays: dict[str, tuple[type, CodeType]] = {}
    for line in body[1].splitlines():
        if function := _MEMBER.match(line):
            fields.append((function[2], _CALLBACK[function[1]]))
        elif field := _FIELD.match(line):
            kind, pointer, label, shape = field.groups()
            single, many = _NUMBER[kind]
            fields.append((label, ctypes.c_void_p if pointer else single))
            if pointer:
                arrays[label] = many, compile(f"({shape})", "core.h", "eval")
    return type(name, (ctypes.Structure,), {"_fields_": fields}), arrays
