"""Commands, run as their entry points run them but without a new interpreter that imports everything."""

import contextlib
import importlib
import io
import sys
from dataclasses import dataclass
from typing import Any
from unittest import mock

import pytest

from handrail.scripts import cli


@dataclass(frozen=True)
class Done:
    """What a command said and the code it ended with."""

    returncode: int
    stdout: str
    stderr: str


def command(*arguments: Any, name: str = "record") -> Done:
    """Run `handrail-<name>`, or `bench <name>`, with its command line, without its words about starting."""
    _, is_bench, last = name.rpartition("bench ")
    main = importlib.import_module(f"handrail.scripts.{'bench.__main__' if is_bench else name}").main
    words = [f"handrail-{name}", *([last] if is_bench else []), *map(str, arguments)]
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
