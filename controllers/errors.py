"""The one error root."""

from collections.abc import Iterable

_LONGEST = 300  # characters of what a library says: PyTorch names every tensor that does not fit


class HandrailError(Exception):
    """Root of every error that Handrail raises on purpose.

    The message names the thing, what was expected, what came, and the choices; it is one line.
    """


def said(error: BaseException) -> str:
    """Return what an exception says, in one line of sane length; its type where it says nothing."""
    words = " ".join(str(error).split()) or type(error).__name__
    return words if len(words) <= _LONGEST else f"{words[:_LONGEST]} …"


def not_installed(wanted_by: str, module: str, extra: str = "") -> HandrailError:
    """Return the error for a module that is not installed, with the command that installs it.

    That installs from the clone: the package named `handrail` on a public index is not this one.

    Args:
        wanted_by: what needs it: a command, a flag.
        module: that is missing.
        extra: of Handrail that brings it; empty for what every installation has.
    """
    what = f"'.[{extra}]'" if extra else "."
    return HandrailError(
        f"{wanted_by}: expected {module}, found none; in the clone of Handrail: "
        f"pip install -c constraints.txt {what}"
    )


def unknown_name(thing: str, name: object, choices: Iterable[str]) -> HandrailError:
    """Return the error for a name that is none of the choices."""
    return HandrailError(f"unknown {thing} {name!r}: expected one of {', '.join(sorted(choices))}")
