"""A piece of work: what is done, what of it is saved, and what is wanted in the end."""

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from filelock import FileLock

from handrail.datasets.format.episode_rows import count_rows, row_files
from handrail.datasets.format.layout import Layout
from handrail.scripts.bench.soak.child import Child, command, send, session, wait_until
from handrail.scripts.bench.soak.faults import CLUSTER, KILLED, Fault
from handrail.scripts.bench.soak.whole import Saved, lines_of, rollouts_of, saved_by, saved_in

os.environ["RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER"] = "0"  # else Ray looks for 127.0.0.1 at another address
_CLUSTER_STARTS, _CLUSTER_ENDS = 600.0, 120.0  # [s]
_PATIENCE = 1800.0  # [s]
_TINY = ("chunk_size=8", "n_action_steps=4", "dim_model=32", "n_heads=2", "dim_feedforward=32")
_RAY = 0.2  # share of the kills that befall a recording on a cluster
_EPISODES, _ROLLOUTS = 12, 6
_RECIPES = {  # recordings, by name
    "reach_ee": "--task reach --mode ee --time_limit 1.5 --seed 3",
    "reach_direct": "--task reach --mode direct --time_limit 1.5 --seed 4",
    "tray": "--task tray --mode ee --time_limit 2.0 --seed 5",
    "pictures": "--task reach --time_limit 1.0 --seed 6 --cameras wrist --image_size 64",
}
_EDITS = {  # command, `{}` for the folder; the name there of its result
    "pack in place": ("edit pack {}/d", "d"),
    "pack into another folder": ("edit pack {}/d --output {}/n", "n"),
    "merge": ("edit merge {}/d {}/e --output {}/n", "n"),
    "merge into the first": ("edit merge {}/d {}/e --output {}/d", "d"),
    "edit delete": ("edit delete {}/d --episodes 1 3 --in_place", "d"),
    "edit trim": ("edit trim {}/d --in_place", "d"),
    "edit keep": ("edit keep {}/d --episodes 2-5 --output {}/n", "n"),
}
_KINDS = {"record": 5, "record_2": 4, "resume": 2, "packed": 2, "edit": 4, "evaluate": 1, "replay": 1}


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
        words = f"record {{}}/d {_RECIPES[recipe]} --dataset.num_episodes {episodes}"
        return self.made(f"{recipe}-{episodes}", words, {}, "d")

    def packed(self, recipe: str, episodes: int) -> Path:
        """Return such a dataset, packed."""
        source = {"d": self.recorded(recipe, episodes)}
        return self.made(f"{recipe}-{episodes}-packed", "edit pack {}/d --output {}/n", source, "n")

    def policy(self) -> Path:
        """Return a policy, trained for a moment."""
        words = f"train {{}}/d --output {{}}/p --steps 6 --batch_size 8 --policy_options {' '.join(_TINY)}"
        return self.made("policy", words, {"d": self.recorded("reach_ee")}, "p")

    def made(self, name: str, words: str, copied: dict[str, Path], result: str) -> Path:
        """Return what a command makes of copies of datasets, when nothing disturbs.

        Args:
            name: of it.
            words: of the command, its name first; `{}` stands for the folder of the copies.
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
                child = Child(_command(words, place), self._folder, name)
                if child.end(_PATIENCE) != 0:
                    raise subprocess.SubprocessError(f"{words}: {child.output}")
                (place / "done").touch()
        return place / result


def _command(words: str, folder: Path) -> list[str]:
    name, *others = (word.format(folder) for word in words.split())
    return [command(name), *others]


class Work:
    """A command that makes something in a folder of its own: the old state, or the whole new one.

    Args:
        name: in the table.
        place: what it makes.
        words: of the command; `{}` stands for the folder.
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
        return None if done and not self.progress() else _command(self._words, self.folder)

    def progress(self) -> int:
        """Return how far it is: quick, and whatever runs."""
        return any(self._hidden(kind).exists() for kind in ("partial", "old"))

    @property
    def steps(self) -> int:
        """The greatest progress."""
        return int(self.wanted != self._before)

    def saved(self) -> Saved:
        """Return what is saved now; raises if a saved piece cannot be read."""
        if not self.place.exists() and self._hidden("old").exists():
            return self._read(self._hidden("old"))  # between two names: the next command finishes it
        return self._read(self.place)

    def lost(self, before: Saved, now: Saved) -> list[str]:
        """Return what was saved and is not any more, and what is not as it would be undisturbed."""
        found = [] if now in (self._before, self.wanted) else ["neither the old dataset nor the new one"]
        return found + [f"{p.name} was changed" for p, whole in self._others.items() if saved_in(p) != whole]

    @property
    def root(self) -> Path | None:
        """The dataset that a user may repair."""
        return self.place if Layout(self.place).manifest.is_file() else None

    def close(self) -> None:
        """End what it needs."""

    def _hidden(self, kind: str) -> Path:
        return self.place.with_name(f".{self.place.name}.{kind}")


class GrowingWork(Work):
    """Work that saves piece by piece, and goes on: recordings and evaluations."""

    def words(self) -> list[str] | None:
        return None if self.saved() == self.wanted else _command(self._words, self.folder)

    def progress(self) -> int:
        return len(self.saved())

    @property
    def steps(self) -> int:
        return len(self.wanted)

    def lost(self, before: Saved, now: Saved) -> list[str]:
        gone = [f"{each} was saved and is gone" for each in before if each not in now]
        return gone + [f"{each} is another" for each in now if now[each] != self.wanted.get(each)]


class RecordingWork(GrowingWork):
    """`handrail-record`, with one process or several, anew or as an addition."""

    _given = ""

    def words(self) -> list[str] | None:
        if not (self.folder / f".{self.place.name}.shards" / "plan.json").exists():
            there = sum(map(count_rows, row_files(Layout(self.place)))) if self.root else 0
            if there == _EPISODES:
                return None
            more = "--resume " if self.root else ""
            self._given = f" {more}--dataset.num_episodes {_EPISODES - there}"
        return _command(self._words + self._given, self.folder)

    def progress(self) -> int:
        return lines_of(self.place)


class RayRecording(RecordingWork):
    """`handrail-record --ray` on a cluster of two computers, both here."""

    def __init__(self, folder: Path, recipe: str, wanted: Saved) -> None:
        file, log = folder / CLUSTER, folder / "cluster.log"
        words = [sys.executable, str(Path(__file__).with_name("ray_nodes.py")), str(file)]
        with open(log, "w") as output:
            self._cluster = subprocess.Popen(words, stdout=output, stderr=output, start_new_session=True)
        wait_until(lambda: file.exists() or self._cluster.poll() is not None, _CLUSTER_STARTS)
        if not file.exists():
            self.close()
            raise TimeoutError(f"no Ray cluster: {log.read_text()[-300:]}")
        address = json.loads(file.read_text())["address"]
        words = f"record {{}}/d {_RECIPES[recipe]} --ray {address}"
        super().__init__("record --ray", folder / "d", words, wanted, read=saved_by)

    def close(self) -> None:
        self._cluster.terminate()
        try:
            self._cluster.wait(_CLUSTER_ENDS)
        except subprocess.TimeoutExpired:
            send(signal.SIGKILL, *session(self._cluster.pid))
            self._cluster.wait()


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
    recipe = str(rng.choice(list(_RECIPES)))
    if fault.cluster or (not only and rng.random() < _RAY and fault.codes >= KILLED):
        return RayRecording(folder, recipe, saved_in(workshop.recorded(recipe)))
    kinds = {only: 1} if only else {"record_2": 5, "evaluate": 1} if fault.workers else _KINDS
    share = np.array(list(kinds.values()), float)
    kind = str(rng.choice(list(kinds), p=share / share.sum()))
    shared = " --workers 2" if fault.workers or kind == "record_2" or rng.random() < 0.2 else ""
    if kind == "evaluate":
        words = f"evaluate {workshop.policy()} --episodes {_ROLLOUTS} --time_limit 1 --json {{}}/e.json"
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
    wanted, words = saved_in(workshop.recorded(recipe)), f"record {{}}/d {_RECIPES[recipe]}{shared}"
    return RecordingWork(name, folder / "d", words, wanted, read=saved_by)


def _edit(folder: Path, workshop: Workshop, rng: np.random.Generator, recipe: str, kind: str) -> Work:
    name = kind if kind == "replay" else str(rng.choice(list(_EDITS)))
    words, result = _EDITS.get(name, ("replay {}/d --episode 0", "d"))
    sources = {"d": workshop.recorded(recipe)}
    if "{}/e" in words:
        sources["e"] = workshop.recorded(recipe, 4)
    for each, root in sources.items():
        shutil.copytree(root, folder / each)
    made = workshop.made(f"{name} {recipe}".replace(" ", "_"), words, sources, result)
    before = saved_in(sources[result]) if result in sources else {}
    return Work(f"{name}, {recipe}", folder / result, words, saved_in(made), before)
