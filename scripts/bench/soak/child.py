"""A command of Handrail's as a user starts it, in a session of its own, last in line for the cores."""

import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Collection
from contextlib import suppress
from pathlib import Path

import psutil

HOOK = Path(__file__).parent / "hook"
_MODEST = ("setpriv", "--bounding-set=-sys_nice", "--inh-caps=-sys_nice")  # stays so, also as root
_LAST = (*(_MODEST if os.geteuid() == 0 and shutil.which("setpriv") else ()), "nice", "-n", "19")
_MOMENT = 0.02  # [s]
_SHOWN = 300  # letters of the last line
_REAPED = 300.0  # workers of a killed command end by themselves within this [s]


def words_of(text: str, *places: object) -> list[str]:
    """Return the words of a command that is installed beside this Python, each place in its `{}`."""
    name, *others = (word.format(*places) for word in text.split())
    return [str(Path(sys.executable).with_name(f"handrail-{name}")), *others]


def hear_signals() -> None:
    """Let commands hear Ctrl-C and the end of a terminal, also where this runs in the background."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


class Child:
    """A command that runs.

    Args:
        words: of its command line.
        folder: for its output, and for the faults that stand in a file.
        name: of these files.
    """

    def __init__(self, words: list[str], folder: Path, name: str) -> None:
        self._faults, self._log = folder / f"{name}.faults", folder / f"{name}.log"
        self.set()
        paths = os.pathsep.join(filter(None, (str(HOOK), os.environ.get("PYTHONPATH", ""))))
        settings = {"PYTHONPATH": paths, "HANDRAIL_SOAK": str(self._faults), "HF_HUB_OFFLINE": "1"}
        self._process = psutil.Popen(
            [*_LAST, *words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,  # a file would suffer the faults too
            stderr=subprocess.STDOUT,
            env={"MUJOCO_GL": "egl"} | os.environ | settings,
            start_new_session=True,
        )
        self.pid, self.begun = self._process.pid, time.monotonic()
        with open(self._log, "ab") as log:  # its own session hears no signal that is meant for the command
            copies = {"stdin": self._process.stdout, "stdout": log, "start_new_session": True}
            self._listener = subprocess.Popen(["cat"], **copies)

    @property
    def runs(self) -> bool:
        """Whether it has not ended yet."""
        return self._process.poll() is None

    @property
    def workers(self) -> list[int]:
        """The processes that its own processes have begun: those forked from its server."""
        with suppress(psutil.Error):
            return [worker.pid for child in self._process.children() for worker in child.children()]
        return []

    @property
    def spent(self) -> float:
        """The processor's time that the command has used, its workers left out [s]."""
        with suppress(psutil.Error):
            return sum(self._process.cpu_times()[:2])
        return 0.0

    @property
    def output(self) -> str:
        """Everything that it printed."""
        return self._log.read_text(errors="replace") if self._log.exists() else ""

    @property
    def last_line(self) -> str:
        """The last line of the output."""
        lines = [line.strip() for line in self.output.replace("\r", "\n").splitlines() if line.strip()]
        return lines[-1][-_SHOWN:] if lines else ""

    def set(self, **faults: float) -> None:
        """Set the faults of its disk and its clock from now on: `delay` [s], `shift` [s]."""
        partial = self._faults.with_suffix(".new")
        partial.write_text(json.dumps(faults))
        os.replace(partial, self._faults)

    def limit(self, which: int, most: int) -> None:
        """Set a limit of the system's for the command and all its processes."""
        for pid in session(self.pid):
            with suppress(ProcessLookupError):
                resource.prlimit(pid, which, (most, resource.prlimit(pid, which)[1]))

    def end(self, patience: float) -> int | None:
        """Wait for its end; return its exit code, or None if it had to be killed."""
        with suppress(psutil.TimeoutExpired, subprocess.TimeoutExpired):
            code = self._process.wait(patience)
            with suppress(subprocess.TimeoutExpired):  # processes that it leaves behind hold the other end
                self._listener.wait(1.0)
            return code
        send(signal.SIGKILL, *session(self.pid))
        self._process.wait()
        return None

    def complaints(self, code: int | None, codes: Collection[int]) -> list[str]:
        """Return what is wrong with its end; processes that it left behind are killed then."""
        wait_until(lambda: not session(self.pid), _REAPED)
        send(signal.SIGKILL, *(left := session(self.pid)))
        found = []
        if code is None:
            found.append("the command did not end by itself")
        elif code not in codes:
            found.append(f"exit code {code}, expected {codes}: {self.last_line}")
        if "Traceback (most recent call last)" in self.output:
            found.append(f"a traceback: {self.last_line}")
        if left:
            found.append(f"{len(left)} processes were left behind")
        return found


def session(leader: int) -> list[int]:
    """Return the living processes of a session, its leader included."""
    found = []
    for process in psutil.process_iter():
        with suppress(OSError, psutil.Error):
            if os.getsid(process.pid) == leader and process.status() != psutil.STATUS_ZOMBIE:
                found.append(process.pid)
    return found


def send(number: int, *pids: int) -> None:
    """Send a signal to processes, as far as they are there."""
    for pid in pids:
        with suppress(ProcessLookupError):
            os.kill(pid, number)


def wait_until(condition: Callable[[], object], patience: float) -> bool:
    """Wait until something is so; return whether it came to that."""
    until = time.monotonic() + patience
    while not condition():
        if time.monotonic() > until:
            return False
        time.sleep(_MOMENT)
    return True
