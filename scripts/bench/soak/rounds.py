"""One round: a piece of work begins, something befalls it, and then it is looked at and goes on."""

import shutil
import time
from pathlib import Path
from typing import Any

import numpy as np

from handrail.datasets.recording.repair import repair
from handrail.scripts.bench.soak.child import Child, wait_until, words_of
from handrail.scripts.bench.soak.faults import FAULTS, Fault
from handrail.scripts.bench.soak.whole import Saved
from handrail.scripts.bench.soak.work import Work, Workshop, any_work

_PATIENCE = 1800.0  # for the end of a command [s]
_ARRIVAL = 900.0  # for the moment of the fault [s]
_STARTS = 8.0  # of the processor's time; a command has begun to work by then [s]
_EPISODE = 1.5  # [s]
_GOES = 4  # commands after a fault


def run_round(
    number: int, seed: int, folder: Path, workshop: Workshop, fault: str = "", work: str = ""
) -> dict[str, Any]:
    """Return what happened in a round.

    Args:
        number: of it.
        seed: of it: which work, which fault, and when.
        folder: for it; removed at the end, if there is no complaint.
        workshop: that it takes from.
        fault: the only one wanted; any when empty.
        work: the only kind of work wanted; any when empty.
    """
    rng, begun = np.random.default_rng([seed, number]), time.monotonic()
    chosen = [each for each in FAULTS if fault in each.name and each.is_possible]
    struck = chosen[int(rng.integers(len(chosen)))]
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    with struck.disk(folder / "disk") as disk:
        place = disk / "work"
        place.mkdir()
        with any_work(place, workshop, rng, struck, work) as piece:
            row = {"round": number, "seed": seed, "fault": struck.name, "work": piece.name}
            row |= _Round(piece, struck, folder, rng).run()
    row["seconds"] = round(time.monotonic() - begun, 1)
    if not row["complaints"]:
        shutil.rmtree(folder, ignore_errors=True)
    return row


class _Round:
    """A piece of work and what befalls it."""

    def __init__(self, work: Work, fault: Fault, folder: Path, rng: np.random.Generator) -> None:
        self._work, self._fault, self._folder, self._rng = work, fault, folder, rng
        self._complaints: list[str] = []
        self._count = 0

    def run(self) -> dict[str, Any]:
        """Return what happened."""
        work, fault, mended = self._work, self._fault, ""
        child = self._begin(work.words())
        struck = self._await_moment(child)
        before = work.saved()
        try:
            if struck:
                fault.strike(child, work.folder, self._rng)
            work.code = code = child.end(_PATIENCE)
        finally:
            fault.heal(work.folder)
        self._judge(child, code, fault.codes if struck else {0})
        after = self._look(before, "after the fault")
        if work.root and self._rng.random() < 0.5:
            repairing = self._begin(words_of("edit repair {}", work.root))
            self._judge(repairing, repairing.end(_PATIENCE), {0})
            mended = "" if "nothing to repair" in repairing.output else repairing.last_line
        goes, last = self._go_on()
        final = self._look(after, "in the end")
        if final != work.wanted:
            self._complaints.append(f"in the end {len(final)} of {len(work.wanted)} are as they should be")
        if work.root and not (report := repair(work.root)).clean:
            self._complaints.append(f"in the end a repair says: {report}")
        if left := [path.name for path in work.folder.iterdir() if path.name.startswith(".")]:
            self._complaints.append(f"left behind: {', '.join(left)}")
        return {
            "struck": struck,
            "saved_before": len(before),
            "lost": sum(final.get(each) != work.wanted.get(each) for each in before),
            "code": code,
            "said": child.last_line,
            "mended": mended,
            "goes": goes,
            "last_code": last,
            "complaints": self._complaints,
        }

    def _begin(self, words: list[str] | None) -> Child:
        assert words is not None, "nothing to do"
        self._count += 1
        return Child(words, self._folder, f"{self._count}")

    def _await_moment(self, child: Child) -> bool:
        """Wait for a random moment of the work; return whether the command still runs then."""
        work, first = self._work, self._work.progress()
        todo = max(0, work.steps - first)
        wanted = first + int(self._rng.integers(0, todo + 1)) if todo else first
        spent = self._rng.uniform(0.0, _STARTS) if wanted == first else 0.0
        wait_until(lambda: not child.runs or (work.progress() >= wanted and child.spent >= spent), _ARRIVAL)
        if wanted > first:
            time.sleep(self._rng.uniform(0.0, _EPISODE))
        return child.runs

    def _judge(self, child: Child, code: int | None, codes: set[int]) -> None:
        """Note an end that may not be."""
        self._complaints += child.complaints(code, codes)

    def _look(self, before: Saved, when: str) -> Saved:
        try:
            now = self._work.saved()
        except Exception as error:
            self._complaints.append(f"{when} saved data cannot be read: {error}")
            return {}
        self._complaints += [f"{when} {each}" for each in self._work.lost(before, now)]
        return now

    def _go_on(self) -> tuple[int, int | None]:
        """Do what a user does: the same work again, until it is done; return how often, and the last code."""
        goes, code = 0, None
        while goes < _GOES and (words := self._work.words()) is not None:
            goes += 1
            child = self._begin(words)
            self._work.code = code = child.end(_PATIENCE)
            finished = code == 2 and "is finished now" in child.output
            self._judge(child, 0 if finished else code, {0})
        return goes, code
