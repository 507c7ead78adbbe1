"""Tables for spreadsheets, which take a cell that begins with `=` for a formula and run it."""

import csv
import io
import math
from collections.abc import Mapping, Sequence
from typing import Any

from handrail.datasets.printable import printable

_FORMULA = tuple("=+-@\t\r\n＝＋－＠")  # how a formula begins, says OWASP


def csv_text(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return rows as CSV, one line of headings first; all have the same columns.

    Text that a spreadsheet would take for a formula gets a `'` in front; numbers stay numbers.
    """
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(map(defused, rows[0]))
    writer.writerows([defused(value) for value in row.values()] for row in rows)
    return stream.getvalue()


def defused(value: Any) -> Any:
    """Return what to write for a value so that no spreadsheet runs it."""
    if not isinstance(value, str):
        return value
    text = printable(value.replace("\r", " "), "\n\t")  # else half of the readers begin a new row there
    harmful = value.lstrip(" ").startswith(_FORMULA) and not _is_number(value)
    return f"'{text}" if harmful else text


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text)) and text.isascii()
    except ValueError:
        return False
