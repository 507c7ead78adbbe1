"""How a training goes: the curve of its loss in `curve.csv`."""

import math
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal

from handrail.controllers.typed import check
from handrail.datasets.storage.atomic import write_whole
from handrail.datasets.storage.strict_json import load_json, write_json

NAME = "curve.csv"
COLUMNS = ("step", "loss", "grad_norm", "lr", "update_s", "dataloading_s")
Row = Mapping[str, float]
_SUMS = "training_state/curve.json"  # in a checkpoint: of the row that is not whole yet
_Sums = dict[Literal[COLUMNS], tuple[float, float]]  # type: ignore[valid-type]


class Curve:
    """Means over the updates since the row before; a row is on disk as soon as it is there.

    Args:
        folder: of the training.
        step: where the training goes on; later rows of an earlier run are dropped.
    """

    def __init__(self, folder: Path, step: int) -> None:
        self._path = folder / NAME
        kept = [_line(row) for row in read_curve(folder) if row["step"] <= step]
        lines = [",".join(COLUMNS), *kept]
        write_whole(self._path, "".join(f"{line}\r\n" for line in lines).encode())

    def add(self, row: Row) -> None:
        """Add a row."""
        with open(self._path, "ab") as file:
            file.write(f"{_line(row)}\r\n".encode())
            file.flush()
            os.fsync(file.fileno())


def write_sums(checkpoint: Path, meters: Mapping[str, Any]) -> None:
    """Write sum and count of columns since the last row, so that a training goes on to the same rows."""
    sums = {name: (meters[name].sum, meters[name].count) for name in COLUMNS if name in meters}
    write_json(checkpoint / _SUMS, {name: each for name, each in sums.items() if math.isfinite(each[0])})


def read_sums(checkpoint: Path | None) -> dict[str, tuple[float, float]]:
    """Return sum and count of columns as a checkpoint has them; an older one has none."""
    if checkpoint is None or not (path := checkpoint / _SUMS).exists():
        return {}
    return check(load_json(path, "sums of a training's curve"), _Sums, repr(str(path)))


def read_curve(folder: Path) -> list[dict[str, float]]:
    """Return the rows of a training's curve; a line that was cut off is left out."""
    path, rows = folder / NAME, []
    text = path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""
    for line in text.splitlines(keepends=True)[1:]:
        with suppress(ValueError):
            numbers = [float(cell) for cell in line.split(",")]
            if line.endswith("\n"):
                rows.append(dict(zip(COLUMNS, numbers, strict=True)))
    return rows


def _line(row: Row) -> str:
    return ",".join(str(row[name]) for name in COLUMNS)
