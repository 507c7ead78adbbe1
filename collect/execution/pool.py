"""Runs jobs in processes of this computer; light to import."""

import multiprocessing
import os
import signal
import sys
import threading
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from multiprocessing import connection, forkserver, parent_process, resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerContext

from handrail.collect.execution.job import TRIES, Job, Result, attempt_alone

RECORDING = ("handrail.collect.commands.shared",)  # what those that record have to load
RENDERING = ("handrail.collect.commands.render",)  # and those that draw
_THREADS = "handrail.collect.execution.preload"
_MOMENT = 0.2  # [s]
_GRACE = 10.0  # for what a process saves just now, before it is killed [s]


def begin_loading(modules: Sequence[str]) -> ForkServerContext:
    """Start the server that workers are forked from, if it does not run yet, and return what forks.

    Ctrl-C is this process's to hear, also while the server loads.

    Args:
        modules: that every worker needs; the first call says which.
    """
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([_THREADS, *modules])
    resource_tracker.ensure_running()  # the server starts it otherwise, and lets signals through again
    heard = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT,))
    try:
        forkserver.ensure_running()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, heard)
    return context


class _Worker:
    """A process, and the job it does."""

    def __init__(self, context: ForkServerContext) -> None:
        self.job: Job | None = None
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs,))
        self.process.start()
        theirs.close()

    def begin(self, job: Job) -> None:
        self.job = job
        with suppress(BrokenPipeError):  # it has died; `ProcessPool.wait` finds out
            self.pipe.send(job)

    def end(self) -> int:
        """Wait for its end; return the exit code."""
        self.pipe.close()
        self.process.join()
        return self.process.exitcode or 0


class ProcessPool:
    """Runs jobs in processes that end with this one.

    Args:
        capacity: how many at a time.
        preload: modules that every process needs.
        fresh: whether every job gets a process of its own.
    """

    def __init__(self, capacity: int, preload: Sequence[str] = (), fresh: bool = False) -> None:
        self.capacity = capacity
        self._context, self._fresh = begin_loading(preload), fresh
        self._workers: dict[Connection, _Worker] = {}
        self._lost = Counter[str]()

    def start(self, job: Job) -> None:
        """Give a job to a process that has none, or to a new one."""
        worker = next((each for each in self._workers.values() if each.job is None), None)
        if worker is None:
            worker = _Worker(self._context)
            self._workers[worker.pipe] = worker
        worker.begin(job)

    def wait(self) -> list[Result]:
        """Wait a moment; return what has finished, and begin again what a process took with it."""
        busy = [pipe for pipe, worker in self._workers.items() if worker.job]
        ready = connection.wait(busy, _MOMENT)
        return [result for pipe in ready if isinstance(pipe, Connection) and (result := self._result(pipe))]

    def close(self) -> None:
        """End all processes, at once; one that saves something may finish that."""
        workers, self._workers = list(self._workers.values()), {}
        for worker in workers:
            worker.process.terminate()
        for worker in workers:
            worker.process.join(_GRACE)
            worker.process.kill()
            worker.end()

    def _result(self, pipe: Connection) -> Result | None:
        worker = self._workers[pipe]
        job, worker.job = worker.job, None
        assert job is not None
        try:
            result: Result = pipe.recv()
        except (EOFError, ConnectionResetError):
            return self._again(job, self._workers.pop(pipe).end())
        if self._fresh:
            self._workers.pop(pipe).end()
        return replace(result, job=job)

    def _again(self, job: Job, code: int) -> Result | None:
        """Begin a job anew whose process died; give it up the third time."""
        self._lost[job.name] += 1
        if self._lost[job.name] < TRIES:
            self.start(job)
            return None
        how = signal.Signals(-code).name if code < 0 else f"exit code {code}"
        hint = ", perhaps for want of memory: fewer --workers need less" if code == -signal.SIGKILL else ""
        error = f"a worker ended {TRIES} times while it did this ({how}){hint};"
        return Result(job, error=f"{error} finished work is kept, and the same command goes on")


def _serve(jobs: Connection) -> None:
    """Do the jobs that come, and send what came of each; Ctrl-C is the parent's to hear."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        while True:
            jobs.send(attempt_alone(jobs.recv()))
    except (EOFError, BrokenPipeError):
        return
    except KeyboardInterrupt:  # a job that saves something turns SIGTERM into it
        sys.exit(128 + signal.SIGTERM)


def _end_with_parent() -> None:
    """Wait until the parent is gone, however that came, and end this process."""
    if parent := parent_process():
        connection.wait([parent.sentinel])
        os.kill(os.getpid(), signal.SIGTERM)
