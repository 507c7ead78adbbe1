"""A piece of work: a command, what of it is saved, and what is wanted in the end."""

import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from filelock import FileLock

from handrail.datasets.format.episode_rows import count_rows, row_files
from handrail.datasets.format.layout import Layout
from handrail.datasets.storage.atomic import beside
from handrail.scripts.bench.soak.child import Child, words_of
from handrail.scripts.bench.soak.faults import KILLED, Fault
from handrail.scripts.bench.soak.ray_nodes import cluster
from handrail.scripts.bench.soak.whole import Saved, lines_of, rollouts_of, saved_by, saved_in

_PATIENCE = 1800.0  # [s]
_TRAIN = (
    "train {0}/d --output {0}/p --steps 6 --batch_size 8 --policy_options"
    " chunk_size=8 n_action_steps=4 dim_model=32 n_heads=2 dim_feedforward=32"
)
_RAY = 0.2  # share of the kills that befall a recording on a cluster
_EPISODES, _ROLLOUTS = 12, 6
_RECIPES = {  # recordings, by name
    "reach_ee": "--task reach --mode ee --time_limit 1.5 --seed 3",
    "reach_direct": "--task reach --mode direct --time_limit 1.5 --seed 4",
    "tray": "--task tray --mode ee --time_limit 2.0 --seed 5",
    "pictures": "--task reach --time_limit 1.0 --seed 6 --cameras wrist --image_size 64",
}
_EDITS = {  # command, `{0}` for the folder; the name there of its result
    "pack in place": ("edit pack {0}/d", "d"),
    "pack into another folder": ("edit pack {0}/d --output {0}/n", "n"),
    "merge": ("edit merge {0}/d {0}/e --output {0}/n", "n"),
    "merge into the first": ("edit merge {0}/d {0}/e --output {0}/d", "d"),
    "edit delete": ("edit delete {0}/d --episodes 1 3 --in_place", "d"),
    "edit trim": ("edit trim {0}/d --in_place", "d"),
    "edit keep": ("edit keep {0}/d --episodes 2-5 --output {0}/n", "n"),
}
KINDS = {"record": 5, "record_2": 4, "resume": 2, "packed": 2, "edit": 4, "evaluate": 1, "replay": 1}


class Workshop:
    """A folder of things that are made once, undisturbed: recordings, packed ones, a policy.

    Args:
        folder: for them; what is there is used again.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def recorded(self, recipe: str, episodes: int = _EPISODES) -> Path:
        """Return a dataset as it is recorded when nothing disturbs."""
        words = f"{_record(recipe)} --dataset.num_episodes {episodes}"
        return self.made(f"{recipe}-{episodes}", words, {}, "d")

    def packed(self, recipe: str, episodes: int) -> Path:
        """Return such a dataset, packed."""
        source = {"d": self.recorded(recipe, episodes)}
        return self.made(f"{recipe}-{episodes}-packed", "edit pack {0}/d --output {0}/n", source, "n")

    def policy(self) -> Path:
        """Return a policy, trained for a moment."""
        return self.made("policy", _TRAIN, {"d": self.recorded("reach_ee")}, "p")

    def made(self, name: str, words: str, copied: dict[str, Path], result: str) -> Path:
        """Return what a command makes of copies of datasets, when nothing disturbs.

        Args:
            name: of it.
            words: of the command, its name first; `{0}` stands for the folder of the copies.
            copied: datasets, by their names there.
            result: the name there of what is made.
        """
        place = self._folder / name
        with FileLock(f"{place}.lock"):
            if not (place / "done").exists():
                shutil.rmtree(place, ignore_errors=True)
                place.mkdir()
                for each, source in copied.items():
                    shutil.copytree(source, place / each)
                child = Child(words_of(words, place), self._folder, name)
                if child.end(_PATIENCE) != 0:
                    raise subprocess.SubprocessError(f"{words}: {child.output}")
                (place / "done").touch()
        return place / result


class Work:
    """A command that makes something in a folder of its own: the old state, or the whole new one.

    Args:
        name: in the table.
        place: what it makes.
        words: of the command; `{0}` stands for the folder.
        wanted: what is to be there in the end.
        before: what is there in the beginning.
        read: what is saved in a place.
    """

    def __init__(
        self,
        name: str,
        place: Path,
        words: str,
        wanted: Saved,
        before: Saved | None = None,
        read: Callable[[Path], Saved] = saved_in,
    ) -> None:
        self.name, self.place, self.folder = name, place, place.parent
        self._words, self.wanted, self._before, self._read = words, wanted, before or {}, read
        self._others = {path: saved_in(path) for path in self.folder.glob("*/") if path != place}
        self.code: int | None = None  # that its last command ended with

    def words(self) -> list[str] | None:
        """Return the command that a user would give now; None where everything is done."""
        done = self.code == 0 or self.saved() == self.wanted != self._before
        return None if done and not self.progress() else words_of(self._words, self.folder)

    def progress(self) -> int:
        """Return how far it is: quick, and whatever runs."""
        return any(beside(self.place, kind).exists() for kind in ("partial", "replaced"))

    @property
    def steps(self) -> int:
        """The greatest progress."""
        return int(self.wanted != self._before)

    def saved(self) -> Saved:
        """Return what is saved now; raises if a saved piece cannot be read."""
        replaced = beside(self.place, "replaced")
        between = not self.place.exists() and replaced.exists()  # the next command finishes it
        return self._read(replaced if between else self.place)

    def lost(self, before: Saved, now: Saved) -> list[str]:
        """Return what was saved and is not any more, and what is not as it would be undisturbed."""
        found = [] if now in (self._before, self.wanted) else ["neither the old dataset nor the new one"]
        return found + [f"{p.name} was changed" for p, whole in self._others.items() if saved_in(p) != whole]

    @property
    def root(self) -> Path | None:
        """The dataset that a user may repair."""
        return self.place if Layout(self.place).manifest.is_file() else None


class GrowingWork(Work):
    """Work that saves piece by piece, and goes on: an evaluation."""

    def words(self) -> list[str] | None:
        return None if self.saved() == self.wanted else words_of(self._words, self.folder)

    def progress(self) -> int:
        return len(self.saved())

    @property
    def steps(self) -> int:
        return len(self.wanted)

    def lost(self, before: Saved, now: Saved) -> list[str]:
        gone = [f"{each} was saved and is gone" for each in before if each not in now]
        return gone + [f"{each} is another" for each in now if now[each] != self.wanted.get(each)]


class RecordingWork(GrowingWork):
    """`handrail-record`, with one process or several, on a cluster, anew or as an addition."""

    _given = ""

    def words(self) -> list[str] | None:
        if not (self.folder / f".{self.place.name}.shards" / "plan.json").exists():
            there = sum(map(count_rows, row_files(Layout(self.place)))) if self.root else 0
            if there == _EPISODES:
                return None
            more = "--resume " if self.root else ""
            self._given = f" {more}--dataset.num_episodes {_EPISODES - there}"
        return words_of(self._words + self._given, self.folder)

    def progress(self) -> int:
        return lines_of(self.place)


@contextmanager
def any_work(
    folder: Path, workshop: Workshop, rng: np.random.Generator, fault: Fault, only: str = ""
) -> Iterator[Work]:
    """Give a piece of work.

    Args:
        folder: for it, empty.
        workshop: that it takes from.
        rng: chooses.
        fault: that it must be fit for.
        only: the only kind that is wanted; any when empty.
    """
    recipe = str(rng.choice(list(_RECIPES)))
    ray = fault.needs == "cluster" or (not only and rng.random() < _RAY and fault.codes >= KILLED)
    if not ray:
        yield _work(folder, workshop, rng, fault.needs == "workers", only, recipe)
        return
    with cluster() as address:
        wanted, words = saved_in(workshop.recorded(recipe)), f"{_record(recipe)} --ray {address}"
        yield RecordingWork("record --ray", folder / "d", words, wanted, read=saved_by)


def _record(recipe: str) -> str:
    return f"record {{0}}/d {_RECIPES[recipe]}"


def _work(
    folder: Path, workshop: Workshop, rng: np.random.Generator, workers: bool, only: str, recipe: str
) -> Work:
    kinds = {only: 1} if only else {"record_2": 5, "evaluate": 1} if workers else KINDS
    share = np.array(list(kinds.values()), float)
    kind = str(rng.choice(list(kinds), p=share / share.sum()))
    shared = " --workers 2" if workers or kind == "record_2" or rng.random() < 0.2 else ""
    if kind == "evaluate":
        words = f"evaluate {workshop.policy()} --episodes {_ROLLOUTS} --time_limit 1 --json {{0}}/e.json"
        wanted = rollouts_of(workshop.made(f"evaluation-{_ROLLOUTS}", words, {}, "e.json"))
        return GrowingWork(f"evaluate{shared}", folder / "e.json", words + shared, wanted, read=rollouts_of)
    if kind in ("edit", "replay"):
        return _edit(folder, workshop, rng, recipe, kind)
    name = f"record{shared}"
    if kind in ("resume", "packed"):
        had = int(rng.choice((2, 4)))
        source = workshop.packed(recipe, had) if kind == "packed" else workshop.recorded(recipe, had)
        shutil.copytree(source, folder / "d")
        name += " --resume" + (", packed before" if kind == "packed" else "")
    return RecordingWork(
        name, folder / "d", _record(recipe) + shared, saved_in(workshop.recorded(recipe)), read=saved_by
    )


def _edit(folder: Path, workshop: Workshop, rng: np.random.Generator, recipe: str, kind: str) -> Work:
    name = kind if kind == "replay" else str(rng.choice(list(_EDITS)))
    words, result = _EDITS.get(name, ("replay {0}/d --episode 0", "d"))
    sources = {"d": workshop.recorded(recipe)}
    if "{0}/e" in words:
        sources["e"] = workshop.recorded(recipe, 4)
    for each, root in sources.items():
        shutil.copytree(root, folder / each)
    made = workshop.made(f"{name} {recipe}".replace(" ", "_"), words, sources, result)
    before = saved_in(sources[result]) if result in sources else {}
    return Work(f"{name}, {recipe}", folder / result, words, saved_in(made), before)
