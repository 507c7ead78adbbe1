"""What runs jobs: in this process, in several processes, or on a cluster."""

import signal
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection, wait
from multiprocessing.context import ForkServerContext
from multiprocessing.process import BaseProcess
from typing import Protocol

from handrail.collect.execution.config import ExecutionConfig
from handrail.collect.execution.forking import begin_loading
from handrail.collect.execution.job import Job, Result, attempt
from handrail.collect.execution.worker import serve

TRIES = 3  # of a job whose process or computer is lost


_MOMENT = 0.2  # [s]
_GRACE = 10.0  # for what a process saves just now, before it is killed [s]


class _Worker:
    """A process, and the job it does."""

    def __init__(self, context: ForkServerContext) -> None:
        self.pipe, theirs = context.Pipe()
        self.process: BaseProcess = context.Process(target=serve, args=(theirs,))
        self.process.start()
        theirs.close()
        self.job: Job | None = None


class ProcessPool:
    """Runs jobs in processes that end with this one.

    Args:
        capacity: how many at a time.
        preload: modules that every process needs.
        fresh: whether every job gets a process of its own.
    """

    def __init__(self, capacity: int, preload: Sequence[str] = (), fresh: bool = False) -> None:
        self.capacity = capacity
        self._context = begin_loading(preload)
        self._fresh = fresh
        self._workers: dict[Connection, _Worker] = {}
        self._lost = Counter[str]()

    def start(self, job: Job) -> None:
        """Give a job to a process that has none, or to a new one."""
        worker = next((each for each in self._workers.values() if each.job is None), None)
        if worker is None:
            worker = _Worker(self._context)
            self._workers[worker.pipe] = worker
        worker.job = job
        with suppress(BrokenPipeError):  # it has died; `wait` finds out
            worker.pipe.send(job)

    def wait(self) -> list[Result]:
        """Wait a moment; return what has finished, and begin again what a process took with it."""
        busy = [pipe for pipe, worker in self._workers.items() if worker.job]
        ready = [self._workers[pipe] for pipe in wait(busy, _MOMENT) if isinstance(pipe, Connection)]
        return [result for worker in ready if (result := self._result(worker))]

    def close(self) -> None:
        """End all processes, at once; one that saves something may finish that."""
        workers, self._workers = list(self._workers.values()), {}
        for worker in workers:
            worker.process.terminate()
        for worker in workers:
            worker.process.join(_GRACE)
            worker.process.kill()
            worker.process.join()
            worker.pipe.close()

    def _result(self, worker: _Worker) -> Result | None:
        job = worker.job
        assert job is not None
        try:
            result: Result = worker.pipe.recv()
        except (EOFError, ConnectionResetError):
            self._end(worker)
            return self._again(job, worker.process.exitcode or 0)
        worker.job = None
        if self._fresh:
            self._end(worker)
        return replace(result, job=job)

    def _end(self, worker: _Worker) -> None:
        del self._workers[worker.pipe]
        worker.pipe.close()
        worker.process.join()

    def _again(self, job: Job, code: int) -> Result | None:
        """Begin a job anew whose process died; give it up the third time."""
        self._lost[job.name] += 1
        if self._lost[job.name] < TRIES:
            self.start(job)
            return None
        how = signal.Signals(-code).name if code < 0 else f"exit code {code}"
        return Result(
            job,
            error=f"a worker was killed {TRIES} times while it did this ({how}), perhaps for want of memory;"
            " what was done is kept, and the same command goes on; fewer --workers need less",
        )


class Engine(Protocol):
    """Runs jobs; one that is lost with its process or computer runs again, `TRIES` times in all."""

    @property
    def capacity(self) -> int:
        """How many jobs it takes at a time."""
        ...

    def start(self, job: Job) -> None:
        """Begin a job."""
        ...

    def wait(self) -> list[Result]:
        """Wait a moment; return what has finished."""
        ...

    def close(self) -> None:
        """End everything that still runs, at once."""
        ...


class Here:
    """Runs jobs in this process, one after the other."""

    capacity = 1

    def __init__(self) -> None:
        self._job: Job | None = None

    def start(self, job: Job) -> None:
        """Take note of a job."""
        self._job = job

    def wait(self) -> list[Result]:
        """Do the job."""
        job, self._job = self._job, None
        return [attempt(job)] if job else []

    def close(self) -> None:
        """Nothing runs."""


def engine_of(config: ExecutionConfig, preload: Sequence[str] = (), fresh: bool = False) -> Engine:
    """Return what runs jobs as the settings say.

    Args:
        config: where.
        preload: modules that every process needs; they are loaded once.
        fresh: whether every job gets a process of its own, that ends with it.
    """
    if config.ray:
        from handrail.collect.execution.cluster import Cluster

        return Cluster(config.ray, fresh)
    if config.is_shared or fresh:
        from handrail.collect.execution.engine import ProcessPool

        return ProcessPool(config.processes, preload, fresh)
    return Here()
