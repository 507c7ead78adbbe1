"""A person who drives in the browser for hours, one process all the time; the soak starts it.

The page is a socket. It drives, ends its episodes, falls silent, answers late, is closed; its server and the
recording are frozen, killed, put on a slow disk and on a clock that jumps. Memory and open files are noted.
"""

import hashlib
import os
import re
import signal
import sys
import time
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from handrail.scripts.bench.soak.child import Child, children, command, hear_signals, wait_until
from handrail.scripts.bench.soak.notes import commit, next_number, note
from handrail.scripts.bench.soak.page import Page

ROUNDS, MEMORY = "driving.jsonl", "memory.jsonl"
_EVERY = 20.0  # between two looks at the memory [s]
_BETWEEN = (40.0, 100.0)  # from one fault to the next [s]
_BACK = 300.0  # after a fault it drives again within this [s]
_START = 1800.0  # [s]
_PATIENCE = 120.0  # [s]


def main() -> None:
    """Drive until time is over."""
    out, hours = Path(sys.argv[1]), float(sys.argv[2])
    hear_signals()
    out.mkdir(parents=True, exist_ok=True)
    first = next_number(out / ROUNDS)
    DrivenHours(out, first).run(time.monotonic() + 3600.0 * hours)


class DrivenHours:
    """One long recording.

    Args:
        out: folder for what happened.
        first: number of the first fault.
    """

    def __init__(self, out: Path, first: int) -> None:
        self._out, self._number = out, first
        self._root = out / f"driven-{first}"
        words = [command("cockpit"), str(self._root), "--cockpit.no_open", "--cockpit.port", "0"]
        self._child = Child([*words, "--dataset.num_episodes", "1000000"], out, f"driven-{first}")
        self._rng = np.random.default_rng([7, first])
        self._sums: dict[str, str] = {}
        self._looked = 0.0

    def run(self, until: float) -> None:
        """Drive, with a fault every minute or so; end with Ctrl-C and look at everything."""
        # the first time on a computer compiles the controller
        wait_until(lambda: "Ready." in self._child.said or not self._child.runs, _START)
        page = Page(re.findall(r"Drive at (\S+)", self._child.said)[-1], self._rng)
        try:
            while time.monotonic() < until and self._child.runs:
                rest = min(until, time.monotonic() + self._rng.uniform(*_BETWEEN))
                self._drive(page, rest)
                if time.monotonic() < until and self._child.runs:
                    self._befall(page)
        finally:
            page.close()
            self._end()

    def _drive(self, page: Page, until: float) -> None:
        while time.monotonic() < until and self._child.runs:
            page.turn()
            if time.monotonic() > self._looked + _EVERY:
                self._look_at_memory(page)

    def _befall(self, page: Page) -> None:
        """Let something happen; note whether it drives again, and that nothing saved is another."""
        faults = {
            "page silent for seconds": lambda: time.sleep(self._rng.uniform(0.5, 6.0)),
            "page closed and opened again": page.reopen,
            "page answers seconds late": lambda: page.lag(self._rng.uniform(1.0, 4.0)),
            "page says nonsense": page.babble,
            "recording frozen for seconds": lambda: self._freeze(self._child.pid),
            "web server frozen for seconds": lambda: self._freeze(self._server),
            "web server killed": lambda: os.kill(self._server, signal.SIGKILL),
            "slow disk for seconds": lambda: self._while(page, delay=self._rng.uniform(0.1, 0.5)),
            "clock jumps forwards": lambda: self._while(page, shift=self._rng.uniform(60.0, 3e7)),
            "clock jumps backwards": lambda: self._while(page, shift=-self._rng.uniform(60.0, 3e7)),
        }
        name = str(self._rng.choice(list(faults)))
        before, began = self._known(), time.monotonic()
        faults[name]()
        drives = self._drives_again(page)
        took = time.monotonic() - began
        complaints = [] if drives else ["it did not drive again"]
        complaints += [] if self._child.runs else [f"it ended: {self._child.last_words}"]
        now = self._known()
        lost = [each for each in before if now.get(each) != before[each]]
        complaints += [f"{each} was saved and is gone or another" for each in lost]
        row = {"round": self._number, "fault": name, "work": "drive in the browser, one process"}
        row |= {"struck": True, "saved_before": _episodes(before), "saved_after": _episodes(now)}
        row |= {"lost": _episodes(lost)}
        row |= {"seconds": round(took, 1), "complaints": complaints, "commit": commit()}
        note(self._out / ROUNDS, row | {"load": round(os.getloadavg()[0], 1)})
        self._number += 1

    def _drives_again(self, page: Page) -> bool:
        """Return whether an episode is saved after this."""
        saved, until = page.saved, time.monotonic() + _BACK
        while page.saved <= saved and time.monotonic() < until and self._child.runs:
            page.turn()
        return page.saved > saved

    def _while(self, page: Page, **faults: float) -> None:
        self._child.set(**faults)
        self._drive(page, time.monotonic() + 15.0)
        self._child.set()

    def _freeze(self, pid: int) -> None:
        os.kill(pid, signal.SIGSTOP)
        time.sleep(self._rng.uniform(0.5, 8.0))
        os.kill(pid, signal.SIGCONT)

    @property
    def _server(self) -> int:
        servers = [pid for pid in children(self._child.pid) if b"cockpit.server" in _words(pid)]
        return servers[-1]

    def _known(self) -> dict[str, str]:
        """Return a digest of every file of saved episodes; each is read once here, and all at the end."""
        known = {}
        for path in self._root.glob("meta/episodes/*/*.parquet"):
            data = self._root / "data" / path.relative_to(self._root / "meta" / "episodes")
            for file in (path, data):
                name = str(file.relative_to(self._root))
                known[name] = self._sums.get(name) if file.exists() else ""
                if known[name] is None:
                    known[name] = self._sums[name] = _digest(file)
        return known

    def _look_at_memory(self, page: Page) -> None:
        self._looked = time.monotonic()
        row: dict[str, Any] = {"seconds": round(self._looked - self._child.begun), "saved": page.saved}
        with suppress(OSError, IndexError):
            for name, pid in (("recording", self._child.pid), ("server", self._server)):
                row[name] = {"pid": pid, **_memory(pid)}
        note(self._out / MEMORY, row | {"drive": self._root.name})

    def _end(self) -> None:
        """End it with Ctrl-C; everything that was saved is whole then."""
        before, ran = self._known(), self._child.runs
        if ran:
            os.kill(self._child.pid, signal.SIGINT)
        code = self._child.end(_PATIENCE)
        orphans = self._child.orphans()
        complaints = [] if code == 130 else [f"exit code {code}: {self._child.last_words}"]
        complaints += [f"{orphans} processes were left behind"] if orphans else []
        complaints += ["a traceback"] if "Traceback" in self._child.said else []
        lost = [each for each in before if not (self._root / each).exists()]
        lost += [each for each in before if each not in lost and _digest(self._root / each) != before[each]]
        repair = Child([command("repair"), str(self._root)], self._out, f"{self._root.name}-repair")
        if repair.end(_PATIENCE * 5) != 0 or "nothing to repair" not in repair.said:
            complaints.append(repair.last_words)
        row = {"round": self._number, "fault": "Ctrl-C at the end", "struck": ran, "code": code}
        row |= {"work": "drive in the browser, one process", "seconds": 0.0, "commit": commit()}
        row |= {"saved_before": _episodes(before), "lost": _episodes(lost), "complaints": complaints}
        note(self._out / ROUNDS, row | {"said": repair.last_words})


def _words(pid: int) -> bytes:
    with suppress(OSError):
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    return b""


def _memory(pid: int) -> dict[str, int]:
    """Return how much memory a process has [kB], how many open files, how many threads."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    said = dict(line.split(":", 1) for line in lines)
    files = len(list(Path(f"/proc/{pid}/fd").iterdir()))
    return {"rss": int(said["VmRSS"].split()[0]), "files": files, "threads": int(said["Threads"])}


def _episodes(files: Iterable[str]) -> int:
    """Return of how many episodes some files are."""
    return len({name.partition("/chunk-")[2] for name in files})


def _digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()[:16]


if __name__ == "__main__":
    main()
