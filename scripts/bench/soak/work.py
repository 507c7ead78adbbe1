"""A piece of work: what is done, what of it is saved, and what it is to be in the end."""

from abc import ABC, abstractmethod
from pathlib import Path

from handrail.scripts.bench.soak.whole import Saved
from handrail.scripts.bench.soak.workshop import Workshop


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
