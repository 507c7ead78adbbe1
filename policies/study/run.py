"""Runs a study: as many jobs at a time as there are workers, each in a process of its own, until all are done."""

import contextlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from handrail.controllers.errors import HandrailError
from handrail.datasets.lock import DatasetLock
from handrail.policies.study.config import StudyConfig
from handrail.policies.study.design import StudyDesign, load_design
from handrail.policies.study.jobs import Job, Layout, jobs
from handrail.policies.study.work import fingerprint

FAILED = 1
_ASLEEP = 0.2  # between two looks at the running jobs [s]
_TAIL = 300  # characters of a failed job's last words


@dataclass
class _State:
    """How it stands."""

    done: set[str] = field(default_factory=set)
    failed: dict[str, str] = field(default_factory=dict)
    running: dict[str, tuple[Job, "subprocess.Popen[bytes]"]] = field(default_factory=dict)

    def ready(self, todo: list[Job]) -> Iterator[Job]:
        """Return the jobs that can begin, what matters most first."""
        for job in todo:
            known = job.name in self.done or job.name in self.failed or job.name in self.running
            if not known and self.done.issuperset(job.needs):
                yield job


def run_study(config: StudyConfig) -> int:
    """Do what is not done yet, then write the report; return the exit code.

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
                _run_all(config, design, layout, state, console)
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
    try:
        content = json.loads(layout.done(job).read_bytes())
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def _run_all(
    config: StudyConfig, design: StudyDesign, layout: Layout, state: _State, console: Console
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
                if len(state.running) >= config.workers:
                    break
                state.running[job.name] = (job, _start(job, config, layout))
            if not state.running:
                break
            time.sleep(_ASLEEP)
            _collect_finished(state, layout)
            now = ", ".join(state.running)
            progress.update(bar, completed=len(state.done), now=now)
    waiting = [job.name for job in todo if job.name not in state.done | state.failed.keys()]
    state.failed |= dict.fromkeys(waiting, "what it needs failed")


def _start(job: Job, config: StudyConfig, layout: Layout) -> "subprocess.Popen[bytes]":
    log = layout.log(job)
    log.parent.mkdir(parents=True, exist_ok=True)
    preset = config.preset
    if preset.endswith(".toml"):
        preset = str(Path(preset).expanduser().absolute())
    threads = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "MKL", "OPENBLAS")}
    with log.open("ab") as file:
        return subprocess.Popen(
            [sys.executable, "-m", "handrail.policies.study.child", str(layout.root), preset, job.name],
            stdin=subprocess.DEVNULL,
            stdout=file,
            stderr=subprocess.STDOUT,
            env=os.environ | threads,
        )


def _collect_finished(state: _State, layout: Layout) -> None:
    for name, (job, process) in list(state.running.items()):
        code = process.poll()
        if code is None:
            continue
        del state.running[name]
        if code == 0:
            state.done.add(name)
        else:
            state.failed[name] = _last_words(layout.log(job), code)


def _last_words(log: Path, code: int) -> str:
    text = log.read_text(encoding="utf-8", errors="replace").strip()
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
            process.wait()
        raise HandrailError("study: interrupted; the same command goes on where it was") from interrupt
