"""How a training goes: a progress bar, and the curve of its loss in `curve.csv`."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from handrail.datasets.storage.atomic import write_whole

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
        self.rows = [row for row in read_curve(folder) if row["step"] <= step]
        lines = [",".join(COLUMNS), *(_line(row) for row in self.rows)]
        write_whole(self._path, "".join(f"{line}\r\n" for line in lines).encode())

    def add(self, row: Row) -> None:
        """Add a row."""
        self.rows.append({name: row[name] for name in COLUMNS})
        with open(self._path, "ab") as file:
            file.write(f"{_line(row)}\r\n".encode())
            file.flush()
            os.fsync(file.fileno())


def _line(row: Row) -> str:
    return ",".join(str(row[name]) for name in COLUMNS)


def read_curve(folder: Path) -> list[dict[str, float]]:
    """Return the rows of a training's curve; a line that was cut off is left out."""
    path = folder / NAME
    if not path.is_file():
        return []
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines(keepends=True)[1:]
    rows = [_numbers(line) for line in lines if line.endswith("\n")]
    return [dict(zip(COLUMNS, row, strict=True)) for row in rows if len(row) == len(COLUMNS)]


def _numbers(line: str) -> list[float]:
    try:
        return [float(cell) for cell in line.split(",")]
    except ValueError:
        return []


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
