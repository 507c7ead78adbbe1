"""Packing, merging and editing: the old dataset or the new one, whole, whatever happens."""

import shutil
from pathlib import Path

from handrail.datasets.format.layout import Layout
from handrail.scripts.bench.soak.child import command
from handrail.scripts.bench.soak.whole import Saved, saved_in
from handrail.scripts.bench.soak.work import Work
from handrail.scripts.bench.soak.workshop import Workshop


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
