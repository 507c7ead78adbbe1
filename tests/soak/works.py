"""The pieces of work: what is done, what of it is saved, and what it is to be in the end."""

import json
import os
import shutil
import signal
import subprocess
import sys
from abc import ABC, abstractmethod
from contextlib import suppress
from pathlib import Path

import numpy as np
from child import command, members, wait_until
from faults import CLUSTER, KILLED, Fault
from whole import Saved, lines_of, rollouts_of, saved_by, saved_in
from workshop import EPISODES, RECIPES, Recipe, Workshop

from handrail.datasets.format.layout import Layout
from handrail.datasets.format.lines import count_lines, rows_of_lines

_RAY = 0.2  # share of the kills that befall a recording on a cluster
_CLUSTER_STARTS, _CLUSTER_ENDS = 600.0, 120.0  # [s]


class Work(ABC):
    """A piece of work in a folder of its own.

    Args:
        folder: empty; everything that it writes goes there.
        workshop: that it takes from.

    Attributes:
        name: in the table.
        wanted: what is to be there in the end.
        many: how many processes do it.
        code: that its last command ended with.
    """

    name: str
    wanted: Saved
    many = 1
    code: int | None = None

    def __init__(self, folder: Path, workshop: Workshop) -> None:
        self.folder, self.workshop = folder, workshop

    @abstractmethod
    def words(self) -> list[str] | None:
        """Return the command that a user would give now; None where everything is done."""

    def ended(self, code: int | None) -> None:
        """Take note of how the command ended."""
        self.code = code

    @abstractmethod
    def progress(self) -> int:
        """Return how far it is: quick, and whatever runs."""

    @abstractmethod
    def saved(self) -> Saved:
        """Return what is saved now; raises if a saved piece cannot be read."""

    def close(self) -> None:  # noqa: B027  (most have nothing)
        """End what it needs."""

    @property
    def steps(self) -> int:
        """How far it can come."""
        return len(self.wanted)

    @property
    def root(self) -> Path | None:
        """The dataset that a user may repair."""
        return None

    def lost(self, before: Saved, now: Saved) -> list[str]:
        """Return what was saved and is not any more, and what is not as it would be undisturbed."""
        gone = [f"{each} was saved and is gone" for each in before if each not in now]
        other = [f"{each} is another" for each in now if now[each] != self.wanted.get(each)]
        return gone + other


class Recording(Work):
    """`handrail-record`, with one process or several, anew or as an addition to what was recorded or packed.

    Args:
        folder: as for all.
        workshop: as for all.
        recipe: what is recorded.
        flags: how the work is shared.
        had: episodes that are there already.
        packed: whether these are packed.
    """

    def __init__(
        self,
        folder: Path,
        workshop: Workshop,
        recipe: Recipe,
        flags: tuple[str, ...] = (),
        had: int = 0,
        packed: bool = False,
    ) -> None:
        super().__init__(folder, workshop)
        self._place, self._recipe, self._flags = folder / "d", recipe, flags
        self._given: list[str] = []
        self.wanted = workshop.saved(workshop.recorded(recipe))
        self.many = int(flags[1]) if flags[:1] == ("--workers",) else 1
        self.name = "record" + (f" {' '.join(flags[:2])}" if flags else "")
        if had:
            source = workshop.packed(recipe, had) if packed else workshop.recorded(recipe, had)
            shutil.copytree(source, self._place)
            self.name += " --resume, packed before" if packed else " --resume"

    @property
    def root(self) -> Path | None:
        return self._place if Layout(self._place).manifest.is_file() else None

    def words(self) -> list[str] | None:
        if not (self.folder / f".{self._place.name}.shards" / "plan.json").exists():
            there = sum(map(count_lines, rows_of_lines(Layout(self._place)))) if self.root else 0
            if there == EPISODES:
                return None
            more = ["--resume"] if self.root else []
            self._given = [*more, "--dataset.num_episodes", str(EPISODES - there)]
        return [command("record"), str(self._place), *self._recipe.flags, *self._flags, *self._given]

    def progress(self) -> int:
        return lines_of(self._place)

    def saved(self) -> Saved:
        return saved_by(self._place)


class RayRecording(Recording):
    """`handrail-record --ray` on a cluster of two computers, both here."""

    def __init__(self, folder: Path, workshop: Workshop, recipe: Recipe) -> None:
        said = folder / CLUSTER
        self._cluster = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name("ray_nodes.py")), str(said)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        if not wait_until(said.exists, _CLUSTER_STARTS):
            self.close()
            raise TimeoutError("no Ray cluster")
        address = json.loads(said.read_text())["address"]
        super().__init__(folder, workshop, recipe, ("--ray", address))
        self.name = "record --ray"

    def close(self) -> None:
        self._cluster.terminate()
        try:
            self._cluster.wait(_CLUSTER_ENDS)
        except subprocess.TimeoutExpired:
            for pid in (*members(self._cluster.pid), self._cluster.pid):
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            self._cluster.wait()


class Editing(Work):
    """`handrail-pack`, `-merge` and `-edit`: what was there before, or the whole result, never another thing.

    Args:
        folder: as for all.
        workshop: as for all.
        name: of the work.
        words: of the command, its name first; `{}` stands for the folder.
        sources: datasets, by their names in the folder.
        result: the name there of what is made.
    """

    def __init__(
        self,
        folder: Path,
        workshop: Workshop,
        name: str,
        words: tuple[str, ...],
        sources: dict[str, Path],
        result: str,
    ) -> None:
        super().__init__(folder, workshop)
        self.name, self._words, self._place = name, words, folder / result
        self._before = workshop.saved(sources[result]) if result in sources else {}
        self._others = {each: workshop.saved(root) for each, root in sources.items() if each != result}
        self.wanted = workshop.saved(workshop.edited(name.replace(" ", "_"), words, sources, result))
        for each, root in sources.items():
            shutil.copytree(root, folder / each)

    @property
    def root(self) -> Path | None:
        return self._place if Layout(self._place).manifest.is_file() else None

    @property
    def steps(self) -> int:
        return 1

    def words(self) -> list[str] | None:
        cut_short = self._partial.exists() or self._old.exists()
        if not cut_short and (self.code == 0 or self.saved() == self.wanted != self._before):
            return None
        return [command(self._words[0]), *(word.format(self.folder) for word in self._words[1:])]

    @property
    def _partial(self) -> Path:
        return self._place.with_name(f".{self._place.name}.partial")

    @property
    def _old(self) -> Path:
        return self._place.with_name(f".{self._place.name}.old")

    def progress(self) -> int:
        return self._partial.exists() or self._old.exists()

    def saved(self) -> Saved:
        if not self._place.exists() and self._old.exists():
            return saved_in(self._old)  # between two names: the next command finishes it
        return saved_in(self._place)

    def lost(self, before: Saved, now: Saved) -> list[str]:
        said = [] if now in (self._before, self.wanted) else ["neither the old dataset nor the new one"]
        for each, whole in self._others.items():
            said += [] if saved_in(self.folder / each) == whole else [f"{each} was changed"]
        return said


class Evaluation(Work):
    """`handrail-evaluate`, with one process or two."""

    _EPISODES = 14

    def __init__(self, folder: Path, workshop: Workshop, workers: int = 1) -> None:
        super().__init__(folder, workshop)
        self.many, self._file = workers, folder / "e.json"
        self.name = "evaluate" + (f" --workers {workers}" if workers > 1 else "")
        words = ("evaluate", str(workshop.policy()), "--episodes", str(self._EPISODES), "--time_limit", "2")
        self._words = (*words, "--json", "{}/e.json")
        whole = workshop.edited("evaluation", self._words, {}, "e.json")
        self.wanted = rollouts_of(whole)

    def words(self) -> list[str] | None:
        if self.saved() == self.wanted:
            return None
        words = [word.format(self.folder) for word in self._words[1:]]
        return [command(self._words[0]), *words, *(("--workers", str(self.many)) if self.many > 1 else ())]

    def progress(self) -> int:
        return len(self.saved())

    def saved(self) -> Saved:
        return rollouts_of(self._file)


class Replaying(Work):
    """`handrail-replay`: reads only."""

    name = "replay"

    def __init__(self, folder: Path, workshop: Workshop, recipe: Recipe) -> None:
        super().__init__(folder, workshop)
        source = workshop.recorded(recipe)
        shutil.copytree(source, folder / "d")
        self.wanted, self._runs = workshop.saved(source), 0

    @property
    def steps(self) -> int:
        return 0

    def words(self) -> list[str] | None:
        self._runs += 1
        return [command("replay"), str(self.folder / "d"), "--episode", "0"] if self._runs < 3 else None

    def progress(self) -> int:
        return 0

    def saved(self) -> Saved:
        return saved_in(self.folder / "d")


def any_work(
    folder: Path, workshop: Workshop, rng: np.random.Generator, fault: Fault, only: str = ""
) -> Work:
    """Return a piece of work.

    Args:
        folder: for it, empty.
        workshop: that it takes from.
        rng: chooses.
        fault: that it must be fit for.
        only: the only kind that is wanted; any when empty.
    """
    recipe = RECIPES[int(rng.integers(len(RECIPES)))]
    kinds = {"record": 5, "record_2": 4, "resume": 2, "packed": 2, "edit": 4, "evaluate": 2, "replay": 1}
    if fault.workers:
        kinds = {"record_2": 3, "evaluate_2": 1}
    if fault.cluster or (not only and rng.random() < _RAY and fault.codes >= KILLED):
        return RayRecording(folder, workshop, recipe)
    names = [only] if only else list(kinds)
    share = np.array([kinds.get(name, 1) for name in names], float)
    kind = str(rng.choice(names, p=share / share.sum()))
    if kind == "edit":
        return _any_edit(folder, workshop, rng, recipe)
    if kind.startswith("evaluate"):
        return Evaluation(folder, workshop, 2 if fault.workers or rng.random() < 0.5 else 1)
    if kind == "replay":
        return Replaying(folder, workshop, recipe)
    shared = ("--workers", "2") if kind == "record_2" or rng.random() < 0.2 else ()
    had = int(rng.choice((2, 4))) if kind in ("resume", "packed") else 0
    return Recording(folder, workshop, recipe, shared, had, packed=kind == "packed")


def _any_edit(folder: Path, workshop: Workshop, rng: np.random.Generator, recipe: Recipe) -> Work:
    whole, part = workshop.recorded(recipe), workshop.recorded(recipe, 4)
    edits = {
        "pack in place": (("pack", "{}/d"), {"d": whole}, "d"),
        "pack into another folder": (("pack", "{}/d", "--output", "{}/n"), {"d": whole}, "n"),
        "merge": (("merge", "{}/d", "{}/e", "--output", "{}/n"), {"d": whole, "e": part}, "n"),
        "merge into the first": (("merge", "{}/d", "{}/e", "--output", "{}/d"), {"d": whole, "e": part}, "d"),
        "edit delete": (("edit", "delete", "{}/d", "--episodes", "1", "3", "--in_place"), {"d": whole}, "d"),
        "edit trim": (("edit", "trim", "{}/d", "--in_place"), {"d": whole}, "d"),
        "edit keep": (
            ("edit", "keep", "{}/d", "--episodes", "2-5", "--output", "{}/n"),
            {"d": whole},
            "n",
        ),
    }
    name = str(rng.choice(list(edits)))
    words, sources, result = edits[name]
    return Editing(folder, workshop, f"{name}, {recipe.name}", words, sources, result)
