"""What runs jobs: in this process, in several processes, or on a cluster."""

from collections.abc import Sequence
from typing import Protocol

from handrail.collect.execution.config import ExecutionConfig
from handrail.collect.execution.job import Job, Result, attempt

TRIES = 3  # of a job whose process or computer is lost


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

    Raises:
        HandrailError: there is no such cluster.
    """
    if config.ray:
        from handrail.collect.execution.cluster import Cluster

        return Cluster(config.ray, fresh)
    if config.is_shared or fresh:
        from handrail.collect.execution.pool import Pool

        return Pool(config.processes, preload, fresh)
    return Here()
