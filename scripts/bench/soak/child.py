"""A command of Handrail's as a user starts it, in a session of its own, last in line for the cores."""

import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

HOOK = Path(__file__).parent / "hook"
_MODEST = ("setpriv", "--bounding-set=-sys_nice", "--inh-caps=-sys_nice")  # stays so, also as root
_LAST = (*(_MODEST if os.geteuid() == 0 and shutil.which("setpriv") else ()), "nice", "-n", "19")
_MOMENT = 0.02  # [s]
_SHOWN = 300  # letters of what a command said last
_REAPED = 300.0  # workers of a killed command end by themselves within this [s]


def command(name: str) -> str:
    """Return the path of a command that is installed beside this Python."""
    return str(Path(sys.executable).with_name(f"handrail-{name}"))


def hear_signals() -> None:
    """Let commands hear Ctrl-C and the end of a terminal, also where this runs in the background."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


class Child:
    """A command that runs.

    Args:
        words: of its command line.
        folder: for what it says, and for the faults that stand in a file.
        name: of these files.
    """

    def __init__(self, words: list[str], folder: Path, name: str) -> None:
        self._faults = folder / f"{name}.faults"
        self.log = folder / f"{name}.log"
        self.set()
        paths = os.pathsep.join(filter(None, (str(HOOK), os.environ.get("PYTHONPATH", ""))))
        settings = {"PYTHONPATH": paths, "HANDRAIL_SOAK": str(self._faults), "HF_HUB_OFFLINE": "1"}
        environment = {"MUJOCO_GL": "egl"} | os.environ | settings
        self.process = subprocess.Popen(
            [*_LAST, *words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,  # a file would be of the faults' concern
            stderr=subprocess.STDOUT,
            env=environment,
            start_new_session=True,
        )
        self.begun = time.monotonic()
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    @property
    def pid(self) -> int:
        """Of the command."""
        return self.process.pid

    @property
    def runs(self) -> bool:
        """Whether it has not ended yet."""
        return self.process.poll() is None

    @property
    def workers(self) -> list[int]:
        """The processes that its own processes have begun: those forked from its server."""
        return [worker for child in children(self.pid) for worker in children(child)]

    @property
    def spent(self) -> float:
        """The processor's time that the command has used, its workers left out [s]."""
        try:
            words = Path(f"/proc/{self.pid}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            return 0.0
        return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")

    def set(self, **faults: float) -> None:
        """Say which disk and clock it has from now on: `delay` [s], `shift` [s]."""
        partial = self._faults.with_suffix(".new")
        partial.write_text(json.dumps(faults))
        os.replace(partial, self._faults)

    def limit(self, which: int, most: int) -> None:
        """Set a limit of the system's for the command and all its processes."""
        for pid in (self.pid, *members(self.pid)):
            with suppress(ProcessLookupError):
                resource.prlimit(pid, which, (most, resource.prlimit(pid, which)[1]))

    def end(self, patience: float) -> int | None:
        """Wait for its end; return its exit code, or None if it had to be killed."""
        try:
            return self.process.wait(patience)
        except subprocess.TimeoutExpired:
            self.kill()
            return None
        finally:
            self._listener.join(_MOMENT * 50)  # processes that it leaves behind may hold the other end

    def kill(self) -> None:
        """Kill everything that it has begun, and itself."""
        for pid in (self.pid, *members(self.pid)):
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        self.process.wait()

    def orphans(self) -> int:
        """Return how many of its processes are left a while after its end; they are killed then."""
        until = time.monotonic() + _REAPED
        while (left := members(self.pid)) and time.monotonic() < until:
            time.sleep(_MOMENT)
        for pid in left:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        return len(left)

    def _listen(self) -> None:
        assert self.process.stdout
        with open(self.log, "ab", buffering=0) as file:
            while data := os.read(self.process.stdout.fileno(), 65_536):
                file.write(data)

    @property
    def said(self) -> str:
        """Everything that it said."""
        return self.log.read_text(errors="replace") if self.log.exists() else ""

    @property
    def last_words(self) -> str:
        """The last line of it."""
        lines = [line.strip() for line in self.said.replace("\r", "\n").splitlines() if line.strip()]
        return lines[-1][-_SHOWN:] if lines else ""


def members(session: int) -> list[int]:
    """Return the living processes of a session, its first one left out."""
    found = []
    for path in Path("/proc").glob("[0-9]*"):
        with suppress(OSError, IndexError):
            words = (path / "stat").read_text().rpartition(")")[2].split()
            if int(words[3]) == session and words[0] != "Z" and int(path.name) != session:
                found.append(int(path.name))
    return found


def children(pid: int) -> list[int]:
    """Return the processes that a process has begun."""
    try:
        return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    except OSError:
        return []


def wait_until(condition, patience: float) -> bool:
    """Wait until something is so; return whether it came to that."""
    until = time.monotonic() + patience
    while not condition():
        if time.monotonic() > until:
            return False
        time.sleep(_MOMENT)
    return True
