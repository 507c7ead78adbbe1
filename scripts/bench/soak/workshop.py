"""What rounds begin with, each made once and undisturbed: recordings, packed ones, a policy."""

import fcntl
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from handrail.scripts.bench.soak.child import Child, command
from handrail.scripts.bench.soak.whole import Saved, saved_in

_PATIENCE = 1800.0  # [s]
_TINY = ("chunk_size=8", "n_action_steps=4", "dim_model=32", "n_heads=2", "dim_feedforward=32")


@dataclass(frozen=True)
class Recipe:
    """A recording.

    Attributes:
        name: of it.
        flags: that it is made with.
    """

    name: str
    flags: tuple[str, ...]


RECIPES = (
    Recipe("reach_ee", ("--task", "reach", "--mode", "ee", "--time_limit", "1.5", "--seed", "3")),
    Recipe("reach_direct", ("--task", "reach", "--mode", "direct", "--time_limit", "1.5", "--seed", "4")),
    Recipe("tray", ("--task", "tray", "--mode", "ee", "--time_limit", "2.0", "--seed", "5")),
    Recipe(
        "pictures",
        ("--task", "reach", "--time_limit", "1.0", "--seed", "6", "--cameras", "wrist", "--image_size", "64"),
    ),
)
EPISODES = 12


class Workshop:
    """A folder of things that are made once.

    Args:
        folder: for them; what is there is used again.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        self._saved: dict[Path, Saved] = {}

    def recorded(self, recipe: Recipe, episodes: int = EPISODES) -> Path:
        """Return a dataset as it is recorded when nothing disturbs."""
        words = ["--dataset.num_episodes", str(episodes)]
        return self._made(f"{recipe.name}-{episodes}", lambda root: ("record", root, *recipe.flags, *words))

    def packed(self, recipe: Recipe, episodes: int) -> Path:
        """Return such a dataset, packed."""
        source = str(self.recorded(recipe, episodes))
        return self._made(f"{recipe.name}-{episodes}-packed", lambda root: ("pack", source, "--output", root))

    def policy(self) -> Path:
        """Return a policy, trained for a moment."""
        source = str(self.recorded(RECIPES[0]))
        words = ("--steps", "6", "--batch_size", "8", "--policy_options", *_TINY)
        return self._made("policy", lambda root: ("train", source, "--output", root, *words))

    def edited(self, name: str, words: tuple[str, ...], copied: dict[str, Path], result: str) -> Path:
        """Return what a command makes of copies of datasets, when nothing disturbs.

        Args:
            name: of it.
            words: of the command, its name first; `{}` stands for the folder of the copies.
            copied: datasets, by their names there.
            result: the name there of what is made.
        """
        place = self._folder / name
        with self._alone(name):
            if not (place / "done").exists():
                shutil.rmtree(place, ignore_errors=True)
                place.mkdir()
                for each, source in copied.items():
                    shutil.copytree(source, place / each)
                self._run(name, tuple(word.format(place) for word in words))
                (place / "done").touch()
        return place / result

    def saved(self, root: Path) -> Saved:
        """Return what is in one of the datasets."""
        if root not in self._saved:
            self._saved[root] = saved_in(root)
        return self._saved[root]

    def _made(self, name: str, words) -> Path:
        root, done = self._folder / name, self._folder / f"{name}.done"
        with self._alone(name):
            if not done.exists():
                shutil.rmtree(root, ignore_errors=True)
                self._run(name, words(str(root)))
                done.touch()
        return root

    @contextmanager
    def _alone(self, name: str) -> Iterator[None]:
        """Let nobody else make the same thing meanwhile."""
        with open(self._folder / f"{name}.lock", "w") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            yield

    def _run(self, name: str, words: tuple[str, ...]) -> None:
        child = Child([command(words[0]), *words[1:]], self._folder, name)
        if child.end(_PATIENCE) != 0:
            raise subprocess.SubprocessError(f"{' '.join(words)}: {child.said}")
