"""Which piece of work a round is about."""

import shutil
from pathlib import Path

import numpy as np

from handrail.datasets.format.layout import Layout
from handrail.scripts.bench.soak.child import command
from handrail.scripts.bench.soak.faults import KILLED, Fault
from handrail.scripts.bench.soak.recordings import RayRecording, RecordingWork
from handrail.scripts.bench.soak.whole import Saved, rollouts_of, saved_in
from handrail.scripts.bench.soak.work import Work
from handrail.scripts.bench.soak.workshop import RECIPES, Recipe, Workshop

_RAY = 0.2  # share of the kills that befall a recording on a cluster


class EvaluationWork(Work):
    """`handrail-evaluate`, with one process or two."""

    _EPISODES = 6

    def __init__(self, folder: Path, workshop: Workshop, workers: int = 1) -> None:
        super().__init__(folder, workshop)
        self.many, self._file = workers, folder / "e.json"
        self.name = "evaluate" + (f" --workers {workers}" if workers > 1 else "")
        words = ("evaluate", str(workshop.policy()), "--episodes", str(self._EPISODES), "--time_limit", "1")
        self._words = (*words, "--json", "{}/e.json")
        whole = workshop.edited(f"evaluation-{self._EPISODES}", self._words, {}, "e.json")
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
        self.wanted = workshop.saved(source)

    @property
    def steps(self) -> int:
        return 0

    def words(self) -> list[str] | None:
        return None if self.code == 0 else [command("replay"), str(self.folder / "d"), "--episode", "0"]

    def progress(self) -> int:
        return 0

    def saved(self) -> Saved:
        return saved_in(self.folder / "d")


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
    kinds = {"record": 5, "record_2": 4, "resume": 2, "packed": 2, "edit": 4, "evaluate": 1, "replay": 1}
    if fault.workers:
        kinds = {"record_2": 5, "evaluate_2": 1}
    if fault.cluster or (not only and rng.random() < _RAY and fault.codes >= KILLED):
        return RayRecording(folder, workshop, recipe)
    names = [only] if only else list(kinds)
    share = np.array([kinds.get(name, 1) for name in names], float)
    kind = str(rng.choice(names, p=share / share.sum()))
    if kind == "edit":
        return _any_edit(folder, workshop, rng, recipe)
    if kind.startswith("evaluate"):
        return EvaluationWork(folder, workshop, 2 if fault.workers or rng.random() < 0.5 else 1)
    if kind == "replay":
        return Replaying(folder, workshop, recipe)
    shared = ("--workers", "2") if kind == "record_2" or rng.random() < 0.2 else ()
    had = int(rng.choice((2, 4))) if kind in ("resume", "packed") else 0
    return RecordingWork(folder, workshop, recipe, shared, had, packed=kind == "packed")


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
