"""Shared by every command: LeRobot-like flags, one line an error, exit codes."""

import contextlib
import ctypes
import inspect
import io
import os
import re
import sys
from collections.abc import Callable, Sequence
from typing import NoReturn

from handrail.controllers.errors import BAD_INPUT, FAILED, INTERRUPTED, HandrailError, message_of
from handrail.controllers.interrupts import Interrupts
from handrail.controllers.numerics.first_use import tell_when_compiling
from handrail.datasets.advanced import without_advanced
from handrail.datasets.printable import printable

HELP_ALL, VERSION = "--help-all", "--version"
STARTING = "Starting; this takes some seconds …"
COMPILING = "Compiling the objectives of this robot, once; this takes seconds …"


def parse[Config](config: type[Config], prog: str, arguments: Sequence[str]) -> Config:
    """Return the config of a command line; `--flag=true` and `--flag` both work, as do `_` and `-`.

    Exits with 0 after `--help`, `--help-all` and `--version`, and with 2 and one line on standard error after
    bad input. `--help` leaves out the flags that are `Advanced`.
    """
    import tyro

    arguments = [_checked(argument) for argument in arguments]
    if VERSION in arguments:
        sys.exit(print_version(prog))
    shown = config
    if HELP_ALL in arguments:
        arguments = ["--help"]
    elif {"-h", "--help"} & set(arguments):
        shown = without_advanced(config)
    more = "" if shown is config else f" {HELP_ALL} shows all flags,"
    said = io.StringIO()
    try:
        with contextlib.redirect_stderr(said):
            return tyro.cli(
                shown,
                prog=prog,
                description=f"{inspect.getdoc(config)}{more} {VERSION} prints the version.",
                args=arguments,
                config=(tyro.conf.OmitSubcommandPrefixes,),
                use_underscores=True,
            )
    except SystemExit as stop:
        if stop.code:
            fail(_one_line(said.getvalue(), prog), BAD_INPUT)
        raise


def print_version(prog: str) -> int:
    """Print the version of Handrail; return the exit code."""
    import importlib.metadata

    print(f"{prog} {importlib.metadata.version('handrail')}")
    return 0


def run(main: Callable[[], int | None]) -> NoReturn:
    """Run a command's body; an expected error becomes one line and exit code 2, an interrupt one and 130."""
    if isinstance(sys.stdout, io.TextIOWrapper):  # one that is not Unicode gets a "?" for what it lacks
        sys.stdout.reconfigure(errors="replace")
    tell_when_compiling(lambda: print(COMPILING, file=sys.stderr, flush=True))
    interrupts = Interrupts()
    try:
        with interrupts:
            code = main()
        sys.exit(code)
    except KeyboardInterrupt as interrupt:
        fail(str(interrupt) or "interrupted", INTERRUPTED)
    except Exception as error:
        if interrupts.asked:  # a library that was imported just then made another error of it
            fail(f"interrupted; {error}" if isinstance(error, HandrailError) else "interrupted", INTERRUPTED)
        if isinstance(error, BrokenPipeError):
            sys.exit(FAILED)
        if isinstance(error, HandrailError | OSError | EOFError):  # a name that is too long; Ctrl-D
            fail(message_of(error), BAD_INPUT)
        raise


def say_starting() -> None:
    """Say that the command runs, before it loads the simulator."""
    print(STARTING, file=sys.stderr, flush=True)


def fail(message: str, code: int) -> NoReturn:
    """Print one line on standard error and exit."""
    print(f"error: {printable(message)}", file=sys.stderr)
    # where an interrupt broke off a library's import, Python would end by SIGINT in place of the code
    ctypes.pythonapi.PyRun_SimpleString(b"")
    sys.exit(code)


def _checked(argument: str) -> str:
    """Return an argument as `tyro` knows it; one that is no text, or has no home, ends the command."""
    value = argument.rpartition("=")[2]
    if any("\udc80" <= letter <= "\udcff" for letter in argument):
        fail(f"argument {os.fsencode(argument)!r}: expected text in UTF-8, got other bytes", BAD_INPUT)
    if re.fullmatch(r"~\S*|~[^/\s]+/.*", value) and os.path.expanduser(value) == value:
        fail(f"argument {argument!r}: expected the home of a person on this computer", BAD_INPUT)
    return _boolean(argument)


def _boolean(argument: str) -> str:
    match = re.fullmatch(r"--([\w.\-]+)=(true|false)", argument, flags=re.IGNORECASE)
    if not match:
        return argument
    *path, name = match[1].split(".")
    return "--" + ".".join([*path, name if match[2].lower() == "true" else f"no_{name}"])


def _one_line(message: str, prog: str) -> str:
    """Return what a boxed message says, in one line."""
    stripped = [line.strip(" │╭╮╰╯─┌┐└┘┤├━") for line in message.splitlines()]
    lines = [line for line in stripped if line.strip("-")]  # a terminal without Unicode has rules of these
    titles = (
        "Parsing error", "Value error", "Invalid choice", "Unrecognized options", "Required options",
        "For full helptext",
    )  # fmt: skip
    said = [line for line in lines if line not in titles and not line.startswith(titles[-1])]
    if "Argument helptext:" in said:
        said = said[: said.index("Argument helptext:")]
    return f"{' '.join(said) or 'bad command line'} (see {prog} --help)"
