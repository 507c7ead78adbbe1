"""Says once that something is being compiled, so that nobody waits without knowing why.

A library does not print: only who asks is told. Commands ask.
"""

from collections.abc import Callable

_waiting: list[Callable[[], None]] = []


def tell_when_compiling(tell: Callable[[], None]) -> None:
    """Call a function when this process compiles something next; once, and nobody else who asked before."""
    _waiting[:] = [tell]


def compiling() -> None:
    """Take note that something is being compiled now."""
    while _waiting:
        _waiting.pop()()
