"""Runs a study: as many jobs at a time as there are workers, each in a process of its own."""

import contextlib
import multiprocessing
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from multiprocessing.process import BaseProcess
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from handrail.controllers.errors import HandrailError
from handrail.datasets.presentation.markdown import read_page, with_part
from handrail.datasets.storage.atomic import explained
from handrail.datasets.storage.lock import DatasetLock
from handrail.policies.imitation.training.installed import check_installed
from handrail.policies.study.config import StudyConfig
from handrail.policies.study.design.design import StudyDesign
from handrail.policies.study.design.jobs import Job, Layout, jobs
from handrail.policies.study.design.load import load_design
from handrail.policies.study.design.progress import StudyProgress
from handrail.policies.study.design.settings import check_policies
from handrail.policies.study.execution.work import FAILED, do

_PRELOAD = "handrail.policies.study.execution.preload"
LOOK_PERIOD = 0.2  # between two looks at the running jobs [s]
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
    progress, console = StudyProgress(design, Layout(config.folder)), Console(stderr=True)
    check_installed("handrail-study", ("torch", "accelerate"), design.policy)
    if config.page:
        with_part(read_page(Path(config.page).expanduser()), f"study {design.name}", "")
    with _alone_in(config):
        state = _State(done=set(progress.done))
        if not config.report_only:
            if any(name.startswith("policy/") for name in progress.missing):
                check_policies(design)
            with _terminating(state):
                _run_all(start, config.workers, progress, state, console)
        from handrail.policies.study.report.report import write_study

        files = write_study(config, StudyProgress(design, progress.layout))
    for name, words in state.failed.items():
        console.print(f"failed: {name}: {words}", style="bold red", highlight=False, markup=False)
    console.print("Written: " + ", ".join(map(str, files)), highlight=False, soft_wrap=True)
    return FAILED if state.failed else 0


@contextlib.contextmanager
def _alone_in(config: StudyConfig) -> Iterator[None]:
    """Hold the study's folder, made if it is not there."""
    with explained(f"--output {config.output}: expected a folder that can be written"):
        lock = DatasetLock(config.folder / ".study", "study", "handrail-study")
    try:
        yield
    finally:
        lock.release()


def _run_all(start: Start, workers: int, progress: StudyProgress, state: _State, console: Console) -> None:
    design, layout = progress.design, progress.layout
    todo = jobs(design)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[now]}"),
    )
    with Progress(*columns, console=console) as shown:
        bar = shown.add_task(f"study {design.name}", total=len(todo), completed=len(state.done), now="")
        while True:
            for job in state.ready(todo):
                if len(state.running) >= workers:
                    break
                with explained(str(layout.log(job))):
                    layout.log(job).unlink(missing_ok=True)  # of an earlier time
                state.running[job.name] = (job, start(job, design, layout))
            if not state.running:
                break
            time.sleep(LOOK_PERIOD)
            _collect_finished(state, layout)
            now = ", ".join(state.running)
            shown.update(bar, completed=len(state.done), now=now)
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
            state.failed[name] = last_words(layout.log(job), process.exitcode)


def last_words(log: Path, code: int | None) -> str:
    """Return what a job said last: its error in a line, or the end of what it wrote."""
    text = log.read_text(encoding="utf-8", errors="replace") if log.is_file() else ""
    errors = [line for line in text.splitlines() if line.startswith("error: ")]
    words = errors[-1].removeprefix("error: ") if errors else text.strip()[-_TAIL:] or "without a word"
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
