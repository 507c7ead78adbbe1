"""The faults: what befalls a command at some moment, and what of it is taken back afterwards."""

import os
import resource
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from handrail.scripts.bench.soak.child import Child, send, session, wait_until
from handrail.scripts.bench.soak.ray_nodes import lose_node

KILLED = {-signal.SIGKILL}
_FINE, _FAILED = {0}, {0, 1, 2}  # a failure that comes too late for the command to notice is none
_FAR = 400 * 86_400.0  # of a clock that jumps [s]
_BEGUN = 600.0  # a command has workers by then [s]
_DISK = 48  # size of the small one [MB]

Strike = Callable[[Child, Path, np.random.Generator], object]


@dataclass(frozen=True)
class Fault:
    """A thing that can go wrong."""

    name: str
    """As in the table."""
    strike: Strike
    """Lets it happen to a command whose work is in a folder."""
    codes: set[int]
    """Exit codes that a command may have after it."""
    heal: Callable[[Path], object] = lambda folder: None
    """Takes it back, once the command has ended."""
    needs: str = ""
    """A command with `workers`, a small `disk` of its own, or work on a `cluster`."""

    @property
    def is_possible(self) -> bool:
        """Whether it can be made here: a disk of its own needs root, a cluster needs Ray."""
        if self.needs == "disk":
            return os.geteuid() == 0 and shutil.which("mount") is not None
        return self.needs != "cluster" or find_spec("ray") is not None

    @contextmanager
    def disk(self, path: Path) -> Iterator[Path]:
        """Provide a folder; on a small disk of its own, where that is needed."""
        path.mkdir()
        if self.needs == "disk":
            subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={_DISK}m", "tmpfs", str(path)], check=True)
        try:
            yield path
        finally:
            if self.needs == "disk":
                subprocess.run(["umount", "-l", str(path)])


def _to_command(number: int) -> Strike:
    return lambda child, folder, rng: send(number, child.pid)


def _to_all(number: int) -> Strike:
    return lambda child, folder, rng: send(number, *session(child.pid))


def _limited(which: int, low: int, high: int) -> Strike:
    return lambda child, folder, rng: child.limit(which, int(rng.integers(low, high)))


def _interrupt_twice(child: Child, folder: Path, rng: np.random.Generator) -> None:
    send(signal.SIGINT, *session(child.pid))  # as a terminal does
    time.sleep(rng.uniform(0.05, 0.5))
    send(signal.SIGINT, *session(child.pid))


def _kill_slowly(child: Child, folder: Path, rng: np.random.Generator) -> None:
    child.set(delay=rng.uniform(0.1, 0.5))
    time.sleep(rng.uniform(0.0, 6.0))
    send(signal.SIGKILL, *session(child.pid))


def _kill_worker(child: Child, folder: Path, rng: np.random.Generator) -> None:
    wait_until(lambda: child.workers or not child.runs, _BEGUN)
    if workers := child.workers:
        send(signal.SIGKILL, int(rng.choice(workers)))


def _freeze(child: Child, folder: Path, rng: np.random.Generator) -> None:
    pid = int(rng.choice(child.workers or [child.pid]))
    send(signal.SIGSTOP, pid)
    time.sleep(rng.uniform(3.0, 12.0))
    send(signal.SIGCONT, pid)


def _ballast(folder: Path) -> Path:
    return folder.parent / "ballast"


def _fill(child: Child, folder: Path, rng: np.random.Generator) -> None:
    """Fill the disk but for a few bytes."""
    ballast, left = _ballast(folder), int(rng.integers(0, 60_000))
    with suppress(OSError):
        ballast.write_bytes(bytes(max(0, shutil.disk_usage(folder).free - left)))


def _lock_folders(folder: Path, sign: str = "+") -> None:
    folders = [folder, *(path for path in folder.rglob("*") if path.is_dir())]
    subprocess.run(["chattr", f"{sign}i", *map(str, folders)], capture_output=True)


FAULTS = (
    Fault("SIGKILL of the command", _to_command(signal.SIGKILL), KILLED),
    Fault("SIGKILL of the command and all its workers", _to_all(signal.SIGKILL), KILLED),
    Fault("SIGKILL while the disk is slow", _kill_slowly, KILLED),
    Fault("SIGKILL of one worker", _kill_worker, _FINE, needs="workers"),
    Fault("a lost Ray node", lambda child, folder, rng: lose_node(), _FINE, needs="cluster"),
    Fault("SIGTERM", _to_command(signal.SIGTERM), {130}),
    Fault("the terminal is closed (SIGHUP)", _to_all(signal.SIGHUP), {-signal.SIGHUP}),
    Fault("Ctrl-C", _to_all(signal.SIGINT), {130}),
    Fault("Ctrl-C twice", _interrupt_twice, {130, -signal.SIGINT}),
    Fault("frozen for seconds (SIGSTOP)", _freeze, _FINE),
    Fault("slow disk", lambda child, _, rng: child.set(delay=rng.uniform(0.1, 0.6)), _FINE),
    Fault("clock jumps forwards", lambda child, _, rng: child.set(shift=rng.uniform(60.0, _FAR)), _FINE),
    Fault("clock jumps backwards", lambda child, _, rng: child.set(shift=-rng.uniform(60.0, _FAR)), _FINE),
    Fault("full disk", _fill, _FAILED, lambda folder: _ballast(folder).unlink(missing_ok=True), needs="disk"),
    Fault("files that cannot grow", _limited(resource.RLIMIT_FSIZE, 0, 20_000), _FAILED),
    Fault("no more file handles", _limited(resource.RLIMIT_NOFILE, 4, 12), _FAILED),
    Fault(
        "read-only folder",
        lambda child, folder, rng: _lock_folders(folder),
        _FAILED,
        lambda folder: _lock_folders(folder, "-"),
    ),
)
