"""The one error root."""

from collections.abc import Iterable


class HandrailError(Exception):
    """Root of every error that Handrail raises on purpose.

    The message names the thing, what was expected, what came, and the choices; it is one line.
    """


def unknown_name(thing: str, name: object, choices: Iterable[str]) -> HandrailError:
    """Return the error for a name that is none of the choices."""
    return HandrailError(f"unknown {thing} {name!r}: expected one of {', '.join(sorted(choices))}")
