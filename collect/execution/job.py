"""A piece of work that may run anywhere, and what came of it."""

import contextlib
import os
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from handrail.controllers.errors import HandrailError, message_of
from handrail.controllers.interrupts import interrupted
from handrail.datasets.presentation.terminal import Terminal

TRIES = 3  # of a job whose process or computer is lost
_FEW, _MANY = 5, 1000  # episodes of a part at least, and parts at most


@dataclass(frozen=True)
class Job:
    """A call whose result depends on its arguments alone: it may run anywhere, in any order, and again."""

    name: str
    """Unique."""
    call: Callable[..., Any]
    """Other processes find it by its module and name."""
    arguments: tuple[Any, ...] = ()
    needs: tuple[str, ...] = ()
    """Names of the jobs that come before."""
    size: int = 1
    """Its part of all the work, for the progress bar."""
    log: Path | None = None
    """Where its output goes, if it runs in a process of its own."""


def part_jobs(call: Callable[..., Any], config: Any, stem: Path, first: int, end: int) -> list[Job]:
    """Return jobs that do episodes in parts of a few, each a dataset of its own, whoever does which.

    Args:
        call: does a part, `(config, folder, first, episodes)`.
        config: of the whole.
        stem: of the parts' folders, which get the number of their first episode.
        first: number of the first episode in the whole.
        end: number after the last.
    """
    size, jobs = max(_FEW, -(-(end - first) // _MANY)), list[Job]()
    for begin in range(first, end, size):
        count, folder = min(size, end - begin), stem.with_name(f"{stem.name}-{begin:07d}")
        name, log = f"episodes {begin} to {begin + count - 1}", folder.with_suffix(".log")
        jobs.append(Job(name, call, (config, folder, begin, count), size=count, log=log))
    return jobs


@dataclass(frozen=True)
class Result:
    """The outcome of a job."""

    job: Job
    value: Any = None
    """The call's return value; None where it failed."""
    error: str = ""
    """Why it failed, in one line; "" where it did not."""
    seconds: float = 0.0


def attempt(job: Job) -> Result:
    """Do a job in this process and return what came of it, whatever that is."""
    start, value, error = time.monotonic(), None, ""
    try:
        value = job.call(*job.arguments)
    except (Exception, SystemExit) as raised:
        if interrupted():
            raise KeyboardInterrupt from raised
        error = _words(raised)
    return Result(job, value, error, time.monotonic() - start)


def attempt_alone(job: Job) -> Result:
    """Do a job in a process that shares the cores with others: one BLAS thread, all output in its log."""
    result = Result(job)
    try:
        with threadpool_limits(1), _output_into(job.log) if job.log else contextlib.nullcontext():
            result = attempt(job)
            if result.error and job.log:
                Terminal(stderr=True).print(f"error: {result.error}")
    except OSError as error:  # of its log
        return replace(result, error=result.error or f"{job.log}: {message_of(error)}")
    return result


def _words(error: BaseException) -> str:
    """Return why a job failed, in one line; print where too, if nobody expects such an error."""
    if isinstance(error, HandrailError | OSError):
        return message_of(error)
    traceback.print_exception(error)
    return f"{type(error).__name__}: {message_of(error)}"


@contextlib.contextmanager
def _output_into(log: Path) -> Iterator[None]:
    """Send all output of this process, also of its libraries, into a file, meanwhile."""
    log.parent.mkdir(parents=True, exist_ok=True)
    streams = [stream for stream in (sys.__stdout__, sys.__stderr__) if stream]
    before = [os.dup(number) for number in (1, 2)]

    def redirect(*targets: int) -> None:
        for stream in streams:
            stream.flush()
        for number, target in zip((1, 2), targets, strict=True):
            os.dup2(target, number)

    with open(log, "ab") as file:
        redirect(file.fileno(), file.fileno())
    try:
        yield
    finally:
        redirect(*before)
        for descriptor in before:
            os.close(descriptor)
