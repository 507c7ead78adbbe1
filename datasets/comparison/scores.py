"""Scores of a study's forms, `participant,condition,score,value,source`: read strictly, or not at all."""

import csv
import io
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from handrail.controllers.errors import HandrailError, message_of, shown
from handrail.controllers.regular_file import open_regular
from handrail.datasets.statistics.contrast import Measure

COLUMNS = ("participant", "condition", "score", "value")
SOURCE = "source"  # may stand behind them: people, or `DEMO`
PEOPLE, DEMO = "people", "demo data: no people took part"
MOST_BYTES = 4 * 1024 * 1024
SCORES = (
    Measure("tlx_raw", "workload (raw TLX)", "0–100", "lower", "mean of NASA-TLX's six scales"),
    Measure(
        "tlx_weighted",
        "workload (weighted TLX)",
        "0–100",
        "lower",
        "NASA-TLX's scales, weighted by how often each was chosen of a pair",
    ),
    Measure("sus", "usability (SUS)", "0–100", "higher", "System Usability Scale"),
)


@dataclass(frozen=True)
class Score:
    """What a form gave.

    Attributes:
        participant: who filled it in.
        condition: of what: a teleop mode.
        score: a name of `SCORES`.
        value: 0 to 100; None where an answer that it needs was not given.
        source: `PEOPLE` or `DEMO`; "" where it is not said.
    """

    participant: str
    condition: str
    score: str
    value: float | None
    source: str = ""


def read_scores(path: Path) -> tuple[Score, ...]:
    """Read all scores; none where there is no file."""
    if not path.exists():
        return ()
    try:
        found = tuple(_rows(_text(path)))
    except (OSError, ValueError, csv.Error) as error:
        raise HandrailError(f"{str(path)!r}: {message_of(error)}") from error
    known: set[tuple[str, str, str]] = set()
    for each in found:
        key = each.participant, each.condition, each.score
        if key in known:
            raise HandrailError(f"{str(path)!r}: expected each score once, got {' '.join(key)} twice")
        known.add(key)
    return found


def _text(path: Path) -> str:
    with open_regular(path) as file:
        data = file.read(MOST_BYTES + 1)
    if len(data) > MOST_BYTES:
        raise ValueError(f"expected at most {MOST_BYTES >> 20} MB, got more")
    return data.decode("utf-8-sig")


def _rows(text: str) -> Iterator[Score]:
    rows = csv.reader(io.StringIO(text), strict=True)
    head = next(rows, [])
    columns = (*COLUMNS, SOURCE) if SOURCE in head else COLUMNS
    if tuple(head) != columns:
        raise ValueError(f"expected the columns {','.join(COLUMNS)}, got {shown(','.join(head))}")
    for row in rows:
        where = f"line {rows.line_num}"
        said = dict(zip(columns, row, strict=False))
        if len(row) != len(columns) or not all(said[name].strip() for name in COLUMNS[:-1]):
            raise ValueError(f"{where}: expected {len(columns)} values, got {shown(','.join(row))}")
        score, source = said["score"], said.get(SOURCE, "")
        names = [each.name for each in SCORES]
        if score not in names:
            raise ValueError(f"{where}: unknown score {shown(score)}: expected one of {', '.join(names)}")
        if source not in ("", PEOPLE, DEMO):
            raise ValueError(f"{where}: unknown source {shown(source)}: expected {PEOPLE} or {DEMO}")
        yield Score(said["participant"], said["condition"], score, _value(said["value"], where), source)


def _value(text: str, where: str) -> float | None:
    if not text:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 <= value <= 100.0:
        raise ValueError(f"{where}: expected a value from 0 to 100, got {shown(text)}")
    return value
