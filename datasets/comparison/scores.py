"""Scores of a study's forms, `participant,condition,score,value,source`: read strictly, or not at all."""

import csv
import io
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from msgspec import Meta

from handrail.controllers.errors import HandrailError, restated, shown
from handrail.controllers.regular_file import read_regular
from handrail.controllers.typed import decoded
from handrail.datasets.statistics.contrast import Measure

COLUMNS = ["participant", "condition", "score", "value"]
SOURCE = "source"  # may stand behind them
PEOPLE, DEMO = "people", "demo data: no people took part"
MOST_BYTES = 4 * 1024 * 1024
_WEIGHTED = "NASA-TLX's scales, weighted by how often each was chosen of a pair"
SCORES = (
    Measure("tlx_raw", "workload (raw TLX)", "0–100", "lower", "mean of NASA-TLX's six scales"),
    Measure("tlx_weighted", "workload (weighted TLX)", "0–100", "lower", _WEIGHTED),
    Measure("sus", "usability (SUS)", "0–100", "higher", "System Usability Scale"),
)


@dataclass(frozen=True)
class Score:
    """One score of a form that a participant filled in."""

    participant: str
    condition: str  # a teleop mode
    score: Literal["tlx_raw", "tlx_weighted", "sus"]
    value: Annotated[float, Meta(ge=0, le=100)] | None  # None where an answer that it needs was not given
    source: Literal["people", "demo data: no people took part", ""] = ""  # "" where it is not said


def read_scores(path: Path) -> tuple[Score, ...]:
    """Read all scores; none where there is no file."""
    if not path.exists():
        return ()
    known: dict[tuple[str, str, str], Score] = {}
    with restated(repr(str(path)), (OSError, ValueError, csv.Error, HandrailError)):
        for each in _rows(path):
            if known.setdefault((each.participant, each.condition, each.score), each) is not each:
                twice = f"{each.participant} {each.condition} {each.score}"
                raise HandrailError(f"expected each score once, got {twice} twice")
    return tuple(known.values())


def _rows(path: Path) -> Iterator[Score]:
    rows = csv.reader(io.StringIO(read_regular(path, MOST_BYTES).decode("utf-8-sig")), strict=True)
    columns = next(rows, [])
    if columns not in (COLUMNS, [*COLUMNS, SOURCE]):
        raise ValueError(f"expected the columns {','.join(COLUMNS)}, got {shown(','.join(columns))}")
    for row in rows:
        where = f"line {rows.line_num}"
        if len(row) != len(columns) or not all(map(str.strip, row[:3])):
            raise ValueError(f"{where}: expected {len(columns)} values, got {shown(','.join(row))}")
        content = {**dict(zip(columns, row, strict=True)), "value": _value(row[3])}
        yield decoded({name: each for name, each in content.items() if each != ""}, Score, where)


def _value(text: str) -> float | None:
    try:
        return float(text) if text else None
    except ValueError:
        return math.nan  # which is out of range
