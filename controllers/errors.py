"""The one error root."""

import contextlib
import importlib.util
from collections.abc import Collection, Iterable, Iterator
from typing import Any

FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130
"""Exit codes of commands: work that failed, input that is refused, Ctrl-C or SIGTERM."""
_LONGEST_MESSAGE = 300  # characters of what a library says: PyTorch names every tensor that does not fit
_LONGEST_VALUE = 80  # characters of what came that a message shows


class HandrailError(Exception):
    """Root of every error that Handrail raises on purpose.

    The message names the thing, what was expected, what came, and the choices; it is one line.
    """


SOLVER_ERRORS = (HandrailError, ArithmeticError, RuntimeError, ValueError)
"""Those of a calculation that finds nothing: of ours, numpy, CasADi, coal."""


def message_of(error: BaseException) -> str:
    """Return what an exception says, in one line of sane length; its type where it says nothing.

    Our own say all that they have to say.
    """
    if isinstance(error, HandrailError):
        return str(error)
    words = " ".join(str(error).split()) or type(error).__name__
    return words if len(words) <= _LONGEST_MESSAGE else f"{words[:_LONGEST_MESSAGE]} …"


@contextlib.contextmanager
def restated(what: str, kinds: type[Exception] | tuple[type[Exception], ...] = Exception) -> Iterator[None]:
    """Make one of our errors, `what: why`, of an error of these kinds in the block."""
    try:
        yield
    except kinds as error:
        raise HandrailError(f"{what}: {message_of(error)}") from error


def first_line(error: BaseException) -> str:
    """Return the first line of an exception's text."""
    return str(error).partition("\n")[0]


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
        f"pip install -c constraints.txt -e {what}"
    )


def imported(name: str, wanted_by: str, module: str, extra: str = "") -> Any:
    """Return a module by its name, such as `mink` of the package mink; arguments as of `not_installed`."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise not_installed(wanted_by, module, extra) from error


def check_installed(wanted_by: str, modules: Collection[str], extra: str) -> None:
    """Check that modules can be imported, without that; arguments as of `not_installed`."""
    for module in modules:
        if importlib.util.find_spec(module) is None:
            raise not_installed(wanted_by, module, extra)


def shown(value: object) -> str:
    """Return what came, in one line of few words; an integer of very many digits has none."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:
        return "an integer that is too large"
    return text if len(text) <= _LONGEST_VALUE else f"{text[: _LONGEST_VALUE - 1]}…"


def unknown_name(thing: str, name: object, choices: Iterable[str]) -> HandrailError:
    """Return the error for a name that is none of the choices."""
    return HandrailError(f"unknown {thing} {shown(name)}: expected one of {', '.join(sorted(choices))}")


def check_known(thing: str, names: Iterable[object], choices: Collection[Any]) -> None:
    """Raise what `unknown_name` returns for the first of some names that is none of the choices."""
    for name in names:
        if name not in choices:
            raise unknown_name(thing, name, choices)
