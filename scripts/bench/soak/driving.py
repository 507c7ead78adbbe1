"""A person who drives in the browser for hours, one process all the time; the soak starts it.

The page is a socket. It drives, ends its episodes, falls silent, answers late, is closed; its server and the
recording are frozen, killed, put on a slow disk and on a clock that jumps. Memory and open files are noted.
"""

import re
import signal
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from websockets.exceptions import WebSocketException

from handrail.datasets.format.episode_rows import row_files
from handrail.datasets.format.layout import Layout
from handrail.datasets.format.metadata import Checksum
from handrail.scripts.bench.page import Page
from handrail.scripts.bench.soak.child import Child, hear_signals, send, wait_until, words_of
from handrail.scripts.bench.soak.notes import DRIVING, MEMORY, next_number, note

_EVERY = 20.0  # between two looks at the memory [s]
_BETWEEN = (40.0, 100.0)  # from one fault to the next [s]
_BACK = 300.0  # after a fault it drives again within this [s]
_START = 1800.0  # [s]
_PATIENCE = 120.0  # [s]
_WHILE = 15.0  # a slow disk or another clock stays so long [s]
_EPISODE = (2.0, 6.0)  # [s]
_ARMED = 0.4  # everything is let go for so long first [s]
_AGAIN = 0.5  # between two asks [s]
_RETRY = 0.7  # as the real page [s]
_GONE = (OSError, WebSocketException, TimeoutError)


class WanderingPage(Page):
    """Drives whatever the robot does, and ends an episode every few seconds.

    Args:
        address: of the cockpit.
        rng: of where it drives.
    """

    def __init__(self, address: str, rng: np.random.Generator) -> None:
        super().__init__(address, "soak-of-handrail")
        self._rng, self._phase = rng, ""
        self._since = self._ends = self._asked = 0.0

    @property
    def saved(self) -> int:
        """How many episodes are saved."""
        return self.frame.get("saved", 0)

    def turn(self) -> None:
        """Take a turn; a server that is gone is asked again."""
        try:
            super().turn()
            if self.frame:
                self._steer(time.monotonic())
        except _GONE:
            self.close()
            time.sleep(_RETRY)

    def reopen(self) -> None:
        """Close the page, and open it again at the next turn."""
        self.close()
        time.sleep(self._rng.uniform(0.0, 5.0))

    def lag(self, seconds: float) -> None:
        """Answer an old frame for a while."""
        self.echo = self.frame.get("stamp", 0.0)
        self.run(seconds)
        self.echo = None

    def babble(self) -> None:
        """Send what is no message."""
        with suppress(*_GONE):
            for words in ("{", "[]", '{"kind": "drive"}', '{"kind": "drive", "seq": 1e99}', "\0" * 5000):
                self.socket.send(words)

    def _steer(self, now: float) -> None:
        """Ask for what comes next; let a hand wander while it drives, and rest else."""
        if self.frame["phase"] != self._phase:
            self._phase, self._since = self.frame["phase"], now
            self._ends = now + self._rng.uniform(*_EPISODE)
        ended = str(self._rng.choice(("success", "success", "failure", "discard")))
        asks = {"ready": "start", "paused": "start", "stopped": "stop", "driving": ended}
        wanted = asks.get(self._phase, "") if self.is_driving else "take"
        due = self._phase != "driving" or not self.is_driving or now > self._ends
        if wanted and due and now > self._asked + _AGAIN:
            self._asked = now
            self.ask(wanted, wanted != "stop")
        if self._phase != "driving" or now < self._since + _ARMED:
            self.axes = [0.0] * len(self.channels)
        else:
            moved = 0.95 * np.array(self.axes) + self._rng.normal(0.0, 0.15, len(self.axes))
            self.axes = np.clip(moved, -1.0, 1.0).round(3).tolist()


class DrivenHours:
    """One long recording.

    Args:
        out: folder for what happened.
        first: number of the first fault.
    """

    def __init__(self, out: Path, first: int) -> None:
        self._out, self._number = out, first
        self._root = out / f"driven-{first}"
        words = "cockpit {} --cockpit.no_open --cockpit.port 0 --dataset.num_episodes 1000000"
        self._child = Child(words_of(words, self._root), out, f"driven-{first}")
        self._rng = np.random.default_rng([7, first])
        self._looked = 0.0

    def run(self, until: float) -> None:
        """Drive, with a fault every minute or so; end with Ctrl-C and look at everything."""
        # the first time on a computer compiles the controller
        wait_until(lambda: "Ready." in self._child.output or not self._child.runs, _START)
        page = WanderingPage(re.findall(r"Drive at (\S+)", self._child.output)[-1], self._rng)
        faults = self._faults(page)
        try:
            while time.monotonic() < until and self._child.runs:
                self._drive(page, min(until, time.monotonic() + self._rng.uniform(*_BETWEEN)))
                if time.monotonic() < until and self._child.runs:
                    name = str(self._rng.choice(list(faults)))
                    self._befall(page, name, faults[name])
        finally:
            page.close()
            self._end()

    def _faults(self, page: WanderingPage) -> Mapping[str, Callable[[], object]]:
        uniform = self._rng.uniform
        return {
            "page silent for seconds": lambda: time.sleep(uniform(0.5, 6.0)),
            "page closed and opened again": page.reopen,
            "page answers seconds late": lambda: page.lag(uniform(1.0, 4.0)),
            "page says nonsense": page.babble,
            "recording frozen for seconds": lambda: self._freeze(self._child.pid),
            "web server frozen for seconds": lambda: self._freeze(self._server),
            "web server killed": lambda: send(signal.SIGKILL, self._server),
            "slow disk for seconds": lambda: self._while(page, delay=uniform(0.1, 0.5)),
            "clock jumps forwards": lambda: self._while(page, shift=uniform(60.0, 3e7)),
            "clock jumps backwards": lambda: self._while(page, shift=-uniform(60.0, 3e7)),
        }

    def _drive(self, page: WanderingPage, until: float, saved: float = np.inf) -> None:
        """Drive until a time, the end of the recording, or more episodes are saved."""
        while time.monotonic() < until and self._child.runs and page.saved <= saved:
            page.turn()
            if time.monotonic() > self._looked + _EVERY:
                self._look_at_memory(page)

    def _befall(self, page: WanderingPage, name: str, strike: Callable[[], object]) -> None:
        """Let something happen; note whether it drives again, and that nothing saved is another."""
        before, began = self._known(), time.monotonic()
        strike()
        saved = page.saved
        self._drive(page, time.monotonic() + _BACK, saved)
        complaints = [] if page.saved > saved else ["it did not drive again"]
        complaints += [] if self._child.runs else [f"it ended: {self._child.last_line}"]
        self._note(name, before, complaints, seconds=round(time.monotonic() - began, 1), struck=True)
        self._number += 1

    def _while(self, page: WanderingPage, **faults: float) -> None:
        self._child.set(**faults)
        self._drive(page, time.monotonic() + _WHILE)
        self._child.set()

    def _freeze(self, pid: int) -> None:
        send(signal.SIGSTOP, pid)
        time.sleep(self._rng.uniform(0.5, 8.0))
        send(signal.SIGCONT, pid)

    @property
    def _server(self) -> int:
        children = psutil.Process(self._child.pid).children()
        return [each.pid for each in children if "cockpit.server" in " ".join(each.cmdline())][-1]

    def _known(self) -> dict[str, Checksum]:
        """Return the checksum of every file of saved episodes that is there."""
        rows = [path.relative_to(self._root / "meta/episodes") for path in row_files(Layout(self._root))]
        files = [self._root / folder / row for row in rows for folder in ("meta/episodes", "data")]
        return {str(file.relative_to(self._root)): Checksum.of(file) for file in files if file.exists()}

    def _note(self, fault: str, before: dict[str, Checksum], complaints: list[str], **row: Any) -> None:
        now = self._known()
        lost = [each for each in before if now.get(each) != before[each]]
        complaints += [f"{each} was saved and is gone or another" for each in lost]
        row |= {"round": self._number, "fault": fault, "work": "drive in the browser, one process"}
        row |= {"saved_before": _episodes(before), "lost": _episodes(lost)}
        note(self._out / DRIVING, row | {"complaints": complaints})

    def _look_at_memory(self, page: WanderingPage) -> None:
        self._looked = time.monotonic()
        row: dict[str, Any] = {"seconds": round(self._looked - self._child.begun), "saved": page.saved}
        with suppress(psutil.Error, IndexError):
            for name, pid in (("recording", self._child.pid), ("server", self._server)):
                process = psutil.Process(pid)
                memory, threads = process.memory_info().rss // 1024, process.num_threads()  # [kB]
                row[name] = {"pid": pid, "rss": memory, "files": process.num_fds(), "threads": threads}
        note(self._out / MEMORY, row | {"drive": self._root.name})

    def _end(self) -> None:
        """End it with Ctrl-C; everything that was saved is whole then."""
        before, ran = self._known(), self._child.runs
        if ran:
            send(signal.SIGINT, self._child.pid)
        code = self._child.end(_PATIENCE)
        complaints = self._child.complaints(code, {130})
        repair = Child(words_of("edit repair {}", self._root), self._out, f"{self._root.name}-repair")
        if repair.end(_PATIENCE * 5) != 0 or "nothing to repair" not in repair.output:
            complaints.append(repair.last_line)
        how = {"seconds": 0.0, "struck": ran, "code": code, "said": repair.last_line}
        self._note("Ctrl-C at the end", before, complaints, **how)


def _episodes(files: Iterable[str]) -> int:
    """Return of how many episodes some files are."""
    return len({name.partition("/chunk-")[2] for name in files})


if __name__ == "__main__":
    place = Path(sys.argv[1])
    hear_signals()
    place.mkdir(parents=True, exist_ok=True)
    DrivenHours(place, next_number(place / DRIVING)).run(time.monotonic() + 3600.0 * float(sys.argv[2]))
