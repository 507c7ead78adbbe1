"""The faults: what befalls a command at some moment, and what of it is taken back afterwards."""

import json
import os
import resource
import signal
import subprocess
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from handrail.scripts.bench.soak.child import Child, members, wait_until

KILLED, HUNG_UP, ASKED = {-signal.SIGKILL}, {-signal.SIGHUP}, {130}
FINE, FAILED = {0}, {0, 1, 2}  # a failure that comes too late for the command to notice is none
CLUSTER = "cluster.json"  # in the folder of work that is done on a cluster
_DAY = 86_400.0  # [s]
_BEGUN = 600.0  # a command has workers by then [s]


@dataclass(frozen=True)
class Fault:
    """What can go wrong.

    Attributes:
        name: of it, in the table.
        strike: lets it happen to a command whose work is in a folder.
        codes: exit codes that a command may have after it.
        heal: takes it back, once the command has ended.
        workers: whether it needs a command with workers.
        disk: whether it needs a small disk of its own.
        cluster: whether it needs work on a cluster.
    """

    name: str
    strike: Callable[[Child, Path, np.random.Generator], None]
    codes: set[int]
    heal: Callable[[Path], None] = lambda folder: None
    workers: bool = False
    disk: bool = False
    cluster: bool = False


def _send(pid: int, number: int) -> None:
    with suppress(ProcessLookupError):
        os.kill(pid, number)


def _kill(child: Child, folder: Path, rng: np.random.Generator) -> None:
    _send(child.pid, signal.SIGKILL)


def _kill_all(child: Child, folder: Path, rng: np.random.Generator) -> None:
    for pid in (*members(child.pid), child.pid):
        _send(pid, signal.SIGKILL)


def _kill_slowly(child: Child, folder: Path, rng: np.random.Generator) -> None:
    child.set(delay=rng.uniform(0.1, 0.5))
    time.sleep(rng.uniform(0.0, 6.0))
    _kill_all(child, folder, rng)


def _kill_worker(child: Child, folder: Path, rng: np.random.Generator) -> None:
    wait_until(lambda: child.workers or not child.runs, _BEGUN)
    if workers := child.workers:
        _send(int(rng.choice(workers)), signal.SIGKILL)


def _terminate(child: Child, folder: Path, rng: np.random.Generator) -> None:
    _send(child.pid, signal.SIGTERM)


def _hang_up(child: Child, folder: Path, rng: np.random.Generator) -> None:
    for pid in (child.pid, *members(child.pid)):
        _send(pid, signal.SIGHUP)


def _interrupt(child: Child, folder: Path, rng: np.random.Generator) -> None:
    for pid in (child.pid, *members(child.pid)):  # as a terminal does
        _send(pid, signal.SIGINT)


def _interrupt_twice(child: Child, folder: Path, rng: np.random.Generator) -> None:
    _interrupt(child, folder, rng)
    time.sleep(rng.uniform(0.05, 0.5))
    _interrupt(child, folder, rng)


def _freeze(child: Child, folder: Path, rng: np.random.Generator) -> None:
    pids = [int(rng.choice(child.workers))] if child.workers else [child.pid]
    for pid in pids:
        _send(pid, signal.SIGSTOP)
    time.sleep(rng.uniform(3.0, 12.0))
    for pid in pids:
        _send(pid, signal.SIGCONT)


def _slow_disk(child: Child, folder: Path, rng: np.random.Generator) -> None:
    child.set(delay=rng.uniform(0.1, 0.6))


def _clock_forwards(child: Child, folder: Path, rng: np.random.Generator) -> None:
    child.set(shift=rng.uniform(60.0, 400 * _DAY))


def _clock_backwards(child: Child, folder: Path, rng: np.random.Generator) -> None:
    child.set(shift=-rng.uniform(60.0, 400 * _DAY))


def _few_files(child: Child, folder: Path, rng: np.random.Generator) -> None:
    child.limit(resource.RLIMIT_NOFILE, int(rng.integers(4, 12)))


def _short_files(child: Child, folder: Path, rng: np.random.Generator) -> None:
    child.limit(resource.RLIMIT_FSIZE, int(rng.integers(0, 20_000)))


def _ballast(folder: Path) -> Path:
    return folder.parent / "ballast"


def _fill(child: Child, folder: Path, rng: np.random.Generator) -> None:
    """Fill the disk but for a few bytes."""
    left = int(rng.integers(0, 60_000))
    with open(_ballast(folder), "wb", buffering=0) as file, suppress(OSError):
        while True:
            file.write(bytes(4096))
    with suppress(OSError):
        os.truncate(_ballast(folder), max(0, _ballast(folder).stat().st_size - left))


def _empty(folder: Path) -> None:
    _ballast(folder).unlink(missing_ok=True)


def _lock_folders(child: Child, folder: Path, rng: np.random.Generator) -> None:
    subprocess.run(["chattr", "+i", *map(str, _folders(folder))], capture_output=True)


def _unlock_folders(folder: Path) -> None:
    subprocess.run(["chattr", "-i", *map(str, _folders(folder))], capture_output=True)


def _folders(folder: Path) -> list[Path]:
    return [folder, *(path for path in folder.rglob("*") if path.is_dir())]


def _lose_node(child: Child, folder: Path, rng: np.random.Generator) -> None:
    _send(json.loads((folder / CLUSTER).read_text())["pid"], signal.SIGUSR1)


FAULTS = (
    Fault("SIGKILL of the command", _kill, KILLED),
    Fault("SIGKILL of the command and all its workers", _kill_all, KILLED),
    Fault("SIGKILL while the disk is slow", _kill_slowly, KILLED),
    Fault("SIGKILL of one worker", _kill_worker, FINE, workers=True),
    Fault("a lost Ray node", _lose_node, FINE, cluster=True),
    Fault("SIGTERM", _terminate, ASKED),
    Fault("the terminal is closed (SIGHUP)", _hang_up, HUNG_UP),
    Fault("Ctrl-C", _interrupt, {130}),
    Fault("Ctrl-C twice", _interrupt_twice, {130, -signal.SIGINT}),
    Fault("frozen for seconds (SIGSTOP)", _freeze, FINE),
    Fault("slow disk", _slow_disk, FINE),
    Fault("clock jumps forwards", _clock_forwards, FINE),
    Fault("clock jumps backwards", _clock_backwards, FINE),
    Fault("full disk", _fill, FAILED, _empty, disk=True),
    Fault("files that cannot grow", _short_files, FAILED),
    Fault("no more file handles", _few_files, FAILED),
    Fault("read-only folder", _lock_folders, FAILED, _unlock_folders),
)
