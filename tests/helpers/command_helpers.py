"""Commands, run as their entry points run them but without a new interpreter that imports everything."""

import contextlib
import io
import re
import sys
from dataclasses import dataclass
from typing import Any
from unittest import mock

import pytest

from handrail.scripts import cli
from handrail.scripts.__main__ import main as handrail_main
from handrail.scripts.bench.__main__ import main as bench_main
from handrail.scripts.commands import COMMANDS


@dataclass(frozen=True)
class Done:
    """What a command said and the code it ended with."""

    returncode: int
    stdout: str
    stderr: str


def command(*arguments: Any, name: str = "record") -> Done:
    """Run `handrail-<name>`, or `bench <name>`, without its words about starting; verbs of edit are names."""
    first, *verb = (f"edit {name}" if name in COMMANDS["edit"].verbs else name).split()
    main = bench_main if first == "bench" else handrail_main
    words = [f"handrail-{first}", *verb, *map(str, arguments)]
    out, error = io.StringIO(), io.StringIO()
    with (
        mock.patch.object(sys, "argv", words),
        mock.patch.object(cli, "tell_when_compiling"),
        mock.patch.object(cli, "say_starting"),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(error),
        pytest.raises(SystemExit) as stop,
    ):
        main()
    return Done(int(stop.value.code or 0), out.getvalue(), error.getvalue())


def ran(*arguments: Any, name: str = "record") -> str:
    """Run a command that ends well; return what it said."""
    done = command(*arguments, name=name)
    assert done.returncode == 0, f"{name} {arguments}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    return done.stdout


def refused(*arguments: Any, name: str = "record", told: str = "") -> str:
    """Run a command that is refused in one line with some words; return the line."""
    done = command(*arguments, name=name)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert done.stderr.startswith("error: ")
    assert told in done.stderr, done.stderr
    return done.stderr


def flags_of(name: str, help: str = "--help-all") -> set[str]:
    """Return the flags of a command, from its own help."""
    shown = command(help, name=name.removeprefix("handrail-")).stdout
    rows = re.findall(r"^[│ ] ((?:-[\w.-]+(?:, )?)+)", shown, re.MULTILINE)
    return {flag for row in rows for flag in row.split(", ")}
