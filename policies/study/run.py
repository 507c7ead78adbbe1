"""Runs a study: as many jobs at a time as there are workers, each in a process of its own."""

import contextlib
import multiprocessing
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from handrail.controllers.errors import HandrailError
from handrail.datasets.lock import DatasetLock
from handrail.policies.study.child import do
from handrail.policies.study.config import StudyConfig
from handrail.policies.study.design import StudyDesign, load_design
from handrail.policies.study.jobs import Job, Layout, jobs
from handrail.policies.study.notes import read_json
from handrail.policies.study.work import fingerprint

FAILED = 1
_PRELOAD = "handrail.policies.study.preload"
_ASLEEP = 0.2  # between two looks at the running jobs [s]
_TAIL = 300  # characters of a failed job's last words


Start = Callable[[Job, StudyDesign, Layout], BaseProcess]


@dataclass
class _State:
    """How it stands."""

    done: set[str] = field(default_factory=set)
    failed: dict[str, str] = field(default_factory=dict)
    running: dict[str, tuple[Job, BaseProcess]] = field(default_factory=dict)

    def ready(self, todo: list[Job]) -> Iterator[Job]:
        """Return the jobs that can begin, what matters most first."""
        for job in todo:
            known = job.name in self.done or job.name in self.failed or job.name in self.running
            if not known and self.done.issuperset(job.needs):
                yield job


def start_job(job: Job, design: StudyDesign, layout: Layout) -> BaseProcess:
    """Begin a job in a process of its own."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([_PRELOAD])
    process = context.Process(target=do, args=(job, design, layout.root), name=job.name)
    process.start()
    return process


def run_study(config: StudyConfig, start: Start = start_job) -> int:
    """Do what is not done yet, then write the report; return the exit code.

    Args:
        config: of the study.
        start: begins a job.

    Raises:
        HandrailError: a setting is wrong, or another process works in the folder.
    """
    config.check()
    design = load_design(config.preset)
    layout, console = Layout(config.folder), Console(stderr=True)
    lock = DatasetLock(config.folder / ".study")
    try:
        state = _State(done={job.name for job in jobs(design) if is_done(job, design, layout)})
        if not config.report_only:
            with _terminating(state):
                _run_all(start, config.workers, design, layout, state, console)
        from handrail.policies.study.report import write_study

        files = write_study(config, design, layout)
    finally:
        lock.release()
    for name, words in state.failed.items():
        console.print(f"failed: {name}: {words}", style="bold red", highlight=False, markup=False)
    console.print("Written: " + ", ".join(map(str, files)), highlight=False, soft_wrap=True)
    return FAILED if state.failed else 0


def is_done(job: Job, design: StudyDesign, layout: Layout) -> bool:
    """Return whether a job was done with just these settings."""
    return finished(job, layout).get("settings") == fingerprint(job, design)


def finished(job: Job, layout: Layout) -> Mapping[str, Any]:
    """Return what a job wrote when it was done; nothing if it is not."""
    return read_json(layout.done(job))


def _run_all(
    start: Start, workers: int, design: StudyDesign, layout: Layout, state: _State, console: Console
) -> None:
    todo = jobs(design)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[now]}"),
    )
    with Progress(*columns, console=console) as progress:
        bar = progress.add_task(f"study {design.name}", total=len(todo), completed=len(state.done), now="")
        while True:
            for job in state.ready(todo):
                if len(state.running) >= workers:
                    break
                state.running[job.name] = (job, start(job, design, layout))
            if not state.running:
                break
            time.sleep(_ASLEEP)
            _collect_finished(state, layout)
            now = ", ".join(state.running)
            progress.update(bar, completed=len(state.done), now=now)
    waiting = [job.name for job in todo if job.name not in state.done | state.failed.keys()]
    state.failed |= dict.fromkeys(waiting, "what it needs failed")


def _collect_finished(state: _State, layout: Layout) -> None:
    for name, (job, process) in list(state.running.items()):
        if process.is_alive():
            continue
        del state.running[name]
        if process.exitcode == 0:
            state.done.add(name)
        else:
            state.failed[name] = _last_words(layout.log(job), process.exitcode)


def _last_words(log: Path, code: int | None) -> str:
    text = log.read_text(encoding="utf-8", errors="replace").strip() if log.is_file() else ""
    errors = [line for line in text.splitlines() if line.startswith("error: ")]
    words = errors[-1].removeprefix("error: ") if errors else text[-_TAIL:]
    return f"{words} (exit code {code}; {log})"


@contextlib.contextmanager
def _terminating(state: _State) -> Iterator[None]:
    """End the running jobs when the study is interrupted; they go on where they were the next time."""
    try:
        yield
    except KeyboardInterrupt as interrupt:
        for _, process in state.running.values():
            process.terminate()
        for _, process in state.running.values():
            process.join()
        raise HandrailError("study: interrupted; the same command goes on where it was") from interrupt
