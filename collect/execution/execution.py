"""Runs jobs wherever the settings say, shows how far it is, and names the slowest and the failed."""

import time
from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Self

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from handrail.collect.execution.config import ExecutionConfig
from handrail.collect.execution.engine import engine_of
from handrail.collect.execution.job import Job, Result
from handrail.controllers.interrupts import Interrupts
from handrail.datasets.presentation.terminal import Terminal

_SLOWEST = 3  # jobs that are named at the end
_WORTH_NAMING = 5.0  # [s]
_LOOK = 1.0  # how often it is asked how far the running jobs are [s]


class Execution:
    """Runs jobs; a context that Ctrl-C and SIGTERM leave with a KeyboardInterrupt, all processes ended.

    Args:
        config: where the jobs run.
        title: what they are, in words.
        console: to show how far it is; nothing without one.
        preload: modules that every process needs; they are loaded once.
        fresh: whether every job gets a process of its own, that ends with it.
    """

    def __init__(
        self,
        config: ExecutionConfig,
        title: str,
        console: Terminal | None = None,
        preload: Sequence[str] = (),
        fresh: bool = False,
    ) -> None:
        self._engine = engine_of(config, preload, fresh)
        self._console = console or Terminal(quiet=True)
        self._progress = Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[words]}", markup=False),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=self._console,
        )
        self._bar = self._progress.add_task(title, total=None, words="")
        self._interrupts = Interrupts()
        self._results: list[Result] = []
        self._done, self._parts, self._looked = 0, dict[str, int](), 0.0

    def __enter__(self) -> Self:
        self._interrupts.__enter__()
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        try:
            self._engine.close()
        finally:
            self._progress.stop()
            self._interrupts.__exit__()
        self._name_slowest_and_failed()

    def say(self, words: str) -> None:
        """Show how it stands, beside the bar."""
        self._progress.update(self._bar, words=words)

    def run(
        self,
        jobs: Iterable[Job],
        wanted: Callable[[Job], bool] = lambda job: True,
        part: Callable[[Job], int] = lambda job: 0,
    ) -> Iterator[Result]:
        """Run jobs and yield what came of each as it is done, in any order.

        A job begins when all that it needs is done, what is first in the list first; one that needs what
        failed does not run, and fails.

        Args:
            jobs: with names that differ.
            wanted: whether a job is still to be done; asked before it begins.
            part: how much of its size a running job has done; asked once a second, for the progress bar.
        """
        todo = OrderedDict((job.name, job) for job in jobs)
        pending, running = set(todo), dict[str, Job]()
        self._progress.update(self._bar, total=sum(job.size for job in todo.values()))
        while self._begin(todo, pending, running, wanted) or running:
            self._look_at(running.values(), part)
            for result in self._engine.wait() if running else ():
                del running[result.job.name]
                if not result.error:
                    pending.discard(result.job.name)
                yield self._noted(result)
        for job in todo.values():
            yield self._noted(Result(job, error="what it needs failed"))

    def _begin(
        self,
        todo: OrderedDict[str, Job],
        pending: set[str],
        running: dict[str, Job],
        wanted: Callable[[Job], bool],
    ) -> bool:
        """Begin what can begin, as much as there is room for; return whether anything left the list."""
        begun, capacity = list[Job](), self._engine.capacity
        for job in todo.values():
            if len(running) >= capacity:
                break
            if pending.isdisjoint(job.needs):
                begun.append(job)
                if wanted(job):
                    self._engine.start(job)
                    running[job.name] = job
        for job in begun:
            del todo[job.name]
            if job.name not in running:
                pending.discard(job.name)
                self._advance(job)
        return bool(begun)

    def _look_at(self, running: Iterable[Job], part: Callable[[Job], int]) -> None:
        """Show how far the running jobs are."""
        now = time.monotonic()
        if now >= self._looked + _LOOK:
            self._looked, self._parts = now, {job.name: min(part(job), job.size) for job in running}
            self._show()

    def _advance(self, job: Job) -> None:
        """Show that a job is over."""
        self._done += job.size
        self._parts.pop(job.name, None)
        self._show()

    def _show(self) -> None:
        self._progress.update(self._bar, completed=self._done + sum(self._parts.values()))

    def _noted(self, result: Result) -> Result:
        self._results.append(replace(result, value=None))
        self._advance(result.job)
        return result

    def _name_slowest_and_failed(self) -> None:
        """Say which jobs failed and why, and which took longest if that is worth a word."""
        slowest = sorted(self._results, key=lambda result: -result.seconds)[:_SLOWEST]
        if len(self._results) > _SLOWEST and slowest[0].seconds > _WORTH_NAMING:
            named = ", ".join(f"{each.job.name} {each.seconds:.1f} s" for each in slowest)
            self._console.print(f"slowest: {named}")
        for each in self._results:
            if each.error:
                log = f" ({each.job.log})" if each.job.log and each.job.log.is_file() else ""
                words = f"failed: {each.job.name}: {each.error}{log}"
                self._console.print(words, style="bold red")
