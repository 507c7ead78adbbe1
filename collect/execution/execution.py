"""Runs jobs wherever the settings say, shows how far it is, and names the slowest and the failed."""

from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Self

from rich.console import RenderableType
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.protocol import is_renderable

from handrail.collect.execution.config import ExecutionConfig
from handrail.collect.execution.job import Job, Result, attempt
from handrail.collect.execution.pool import ProcessPool
from handrail.controllers.errors import HandrailError
from handrail.controllers.interrupts import Interrupts
from handrail.datasets.presentation.terminal import Terminal

if TYPE_CHECKING:
    from handrail.collect.execution.cluster import Cluster

_SLOWEST = 3  # jobs that are named at the end
_WORTH_NAMING = 5.0  # [s]


class WorkBar(Progress):
    """How much of the work is done, in words too, and how long it takes; a context that shows it.

    Args:
        console: to draw on.
        title: what is done.
        total: how much there is to do.
        above: what rich can draw of these is shown above the bar.
    """

    def __init__(
        self, console: Terminal, title: str, total: int | None = None, above: Sequence[Any] = ()
    ) -> None:
        self._above = [each for each in above if is_renderable(each)]  # the bar draws itself while it is made
        super().__init__(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[words]}", markup=False),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=console,
        )
        self._task = self.add_task(title, total=total, words="")

    def show(self, **changes: Any) -> None:
        """Show changes: `words`, `total`, `completed`, or by how much to `advance`."""
        self.update(self._task, **changes)

    def get_renderables(self) -> Iterable[RenderableType]:
        """Return what is shown."""
        yield from self._above
        yield from super().get_renderables()


class _InProcess:
    """Runs jobs in this process, one after the other."""

    capacity = 1

    def __init__(self) -> None:
        self._job: Job | None = None

    def start(self, job: Job) -> None:
        self._job = job

    def wait(self) -> list[Result]:
        job, self._job = self._job, None
        return [attempt(job)] if job else []

    def close(self) -> None:
        pass


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
        self._executor = _executor(config, preload, fresh)
        self._console = console or Terminal(quiet=True)
        self._bar = WorkBar(self._console, title)
        self._interrupts = Interrupts()
        self._results: list[Result] = []

    def __enter__(self) -> Self:
        self._interrupts.__enter__()
        self._bar.start()
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        try:
            self._executor.close()
        finally:
            self._bar.stop()
            self._interrupts.__exit__()
        if not isinstance(error, HandrailError):  # which says what failed
            self._name_slowest_and_failed()

    def say(self, words: str) -> None:
        """Show how it stands, beside the bar."""
        self._bar.show(words=words)

    def run(self, jobs: Iterable[Job], wanted: Callable[[Job], bool] = lambda job: True) -> Iterator[Result]:
        """Run jobs and yield what came of each as it is done, in any order.

        A job begins when all that it needs is done, what is first in the list first; one that needs what
        failed does not run, and fails.

        Args:
            jobs: with names that differ.
            wanted: whether a job is still to be done; asked before it begins.
        """
        todo, running = OrderedDict((job.name, job) for job in jobs), 0
        pending = set(todo)
        self._bar.show(total=sum(job.size for job in todo.values()))
        while True:
            capacity = self._executor.capacity
            while running < capacity and (job := _next(todo, pending)):
                if wanted(job):
                    self._executor.start(job)
                    running += 1
                else:
                    pending.discard(job.name)
                    self._bar.show(advance=job.size)
            if not running:
                break
            for result in self._executor.wait():
                running -= 1
                if not result.error:
                    pending.discard(result.job.name)
                yield self._noted(result)
        for job in todo.values():
            yield self._noted(Result(job, error="a job that it needs failed"))

    def _noted(self, result: Result) -> Result:
        self._results.append(replace(result, value=None))
        self._bar.show(advance=result.job.size)
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


def _executor(
    config: ExecutionConfig, preload: Sequence[str], fresh: bool
) -> "_InProcess | ProcessPool | Cluster":
    if config.ray:
        from handrail.collect.execution.cluster import Cluster

        return Cluster(config.ray, fresh)
    if config.is_shared or fresh:
        return ProcessPool(config.processes, preload, fresh)
    return _InProcess()


def _next(todo: OrderedDict[str, Job], pending: set[str]) -> Job | None:
    """Take the first job that needs nothing which is not done."""
    found = next((name for name, job in todo.items() if pending.isdisjoint(job.needs)), None)
    return todo.pop(found) if found is not None else None
