"""How a training goes: a progress bar, and the curve of its loss in `curve.csv`."""

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

NAME = "curve.csv"
COLUMNS = ("step", "loss", "grad_norm", "lr", "update_s", "dataloading_s")
Row = Mapping[str, float]


class Curve:
    """Means over the updates since the row before; a row is on disk as soon as it is there.

    Args:
        folder: of the training.
        step: where the training goes on; later rows of an earlier run are dropped.
    """

    def __init__(self, folder: Path, step: int) -> None:
        self._path = folder / NAME
        folder.mkdir(parents=True, exist_ok=True)
        self.rows = [row for row in read_curve(folder) if row["step"] <= step]
        with open(self._path, "w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(COLUMNS)
            writer.writerows([row[name] for name in COLUMNS] for row in self.rows)

    def add(self, row: Row) -> None:
        """Add a row."""
        self.rows.append({name: row[name] for name in COLUMNS})
        with open(self._path, "a", newline="") as file:
            csv.writer(file).writerow([row[name] for name in COLUMNS])


def read_curve(folder: Path) -> list[dict[str, float]]:
    """Return the rows of a training's curve; a line that was cut off is left out."""
    path = folder / NAME
    if not path.is_file():
        return []
    with open(path, newline="") as file:
        rows = list(csv.reader(file))[1:]
    return [dict(zip(COLUMNS, map(float, row), strict=True)) for row in rows if len(row) == len(COLUMNS)]


class Bar:
    """A progress bar with the last loss.

    Args:
        done: updates already made.
        total: updates in the end.
        shown: whether there is anything to see.
    """

    def __init__(self, done: int, total: int, shown: bool = True) -> None:
        columns = (TextColumn("training"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
        self._progress = Progress(
            *columns, TextColumn("{task.description}"), console=Console(stderr=True), disable=not shown
        )
        self._task = self._progress.add_task("", total=total, completed=done)
        self._progress.start()

    def advance(self) -> None:
        """Count an update."""
        self._progress.advance(self._task)

    def say(self, loss: float) -> None:
        """Show a loss."""
        self._progress.update(self._task, description=f"loss {loss:.4f}")

    def close(self) -> None:
        """Leave the bar as it is."""
        self._progress.stop()


@dataclass(frozen=True)
class Watch:
    """What is seen of a training.

    Attributes:
        curve: of the loss; None in a process that does not write it.
        bar: its progress.
    """

    curve: Curve | None
    bar: Bar

    def see(self, row: Row) -> None:
        """Write down and show the means of some updates."""
        if self.curve is not None:
            self.curve.add(row)
            self.bar.say(row["loss"])
