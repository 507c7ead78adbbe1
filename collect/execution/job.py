"""A piece of work that may run anywhere, and what came of it."""

import contextlib
import os
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from handrail.controllers.errors import HandrailError, message_of
from handrail.controllers.interrupts import interrupted
from handrail.datasets.presentation.terminal import Terminal


@dataclass(frozen=True)
class Job:
    """A call whose result depends on its arguments alone: it may run anywhere, in any order, and again.

    Attributes:
        name: of the job, unique.
        call: what is called; other processes find it by its module and name.
        arguments: of the call; they can be pickled.
        needs: names of the jobs that come before.
        size: how much it is of all the work, for the progress bar.
        log: where it says what it says, if it runs in a process of its own.
    """

    name: str
    call: Callable[..., Any]
    arguments: tuple[Any, ...] = ()
    needs: tuple[str, ...] = ()
    size: int = 1
    log: Path | None = None


@dataclass(frozen=True)
class Result:
    """What came of a job.

    Attributes:
        job: which one.
        value: what the call returned; None where it failed.
        error: why it failed, in one line; "" where it did not.
        seconds: how long it took [s].
    """

    job: Job
    value: Any = None
    error: str = ""
    seconds: float = 0.0


def attempt(job: Job, logged: bool = False) -> Result:
    """Do a job and return what came of it, whatever that is.

    Args:
        job: what is done.
        logged: whether all that this process says meanwhile goes to the job's log.
    """
    start = time.monotonic()
    value, error = None, ""
    with _said_into(job.log) if logged and job.log else contextlib.nullcontext():
        try:
            value = job.call(*job.arguments)
        except (Exception, SystemExit) as raised:
            if interrupted():
                raise KeyboardInterrupt from raised
            error = _words(raised)
            if logged and job.log:
                Terminal(stderr=True).print(f"error: {error}")
    return Result(job, value, error, time.monotonic() - start)


def _words(error: BaseException) -> str:
    """Return why a job failed, in one line; where that is no expected way, show where too."""
    if isinstance(error, HandrailError | OSError):
        return message_of(error) if isinstance(error, OSError) else str(error)
    traceback.print_exception(error)
    return f"{type(error).__name__}: {message_of(error)}"


@contextlib.contextmanager
def _said_into(log: Path) -> Iterator[None]:
    """Send everything that this process says into a file, meanwhile."""
    log.parent.mkdir(parents=True, exist_ok=True)
    streams = sys.__stdout__, sys.__stderr__
    with open(log, "ab") as file:
        before = [os.dup(number) for number in (1, 2)]
        _flush(*streams)
        for number in (1, 2):
            os.dup2(file.fileno(), number)
    try:
        yield
    finally:
        _flush(*streams)
        for number, descriptor in zip((1, 2), before, strict=True):
            os.dup2(descriptor, number)
            os.close(descriptor)


def _flush(*streams: Any) -> None:
    for stream in streams:
        if stream is not None:
            stream.flush()
