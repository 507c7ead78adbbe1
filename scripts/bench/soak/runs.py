"""Evaluations and replays."""

import shutil
from pathlib import Path

from handrail.scripts.bench.soak.child import command
from handrail.scripts.bench.soak.whole import Saved, rollouts_of, saved_in
from handrail.scripts.bench.soak.work import Work
from handrail.scripts.bench.soak.workshop import Recipe, Workshop


class Evaluation(Work):
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
