"""One value for a table, wherever it is shown: here on a terminal, in `markup` as HTML, in `markdown`."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from rich import box
from rich import table as rich_table
from rich.console import Console, ConsoleOptions
from rich.text import Text

from handrail.datasets.printable import printable

_NUMBER = re.compile(r"[-+]?\d[\d.]*(e[-+]?\d+)?|[-–]|")
_WHOLE = 14  # a cell of so many letters is not broken
_GAP = 2  # between two columns
_FRAME: Any = {"box": box.SIMPLE_HEAD, "padding": (0, 1, 0, 0), "pad_edge": False, "show_edge": False}


@dataclass(frozen=True)
class Cell:
    """A cell of a table."""

    text: str  # What it says
    look: str = ""  # A class of the style: `detected`, `quiet` or ""; only of HTML
    note: str = ""  # Shown when pointed at; only of HTML
    below: str = ""  # A second line, smaller

    def __str__(self) -> str:
        return "\n".join(map(printable, filter(None, (self.text, self.below))))


@dataclass(frozen=True)
class Table:
    """Headings and rows.

    On a terminal lines break between words and nothing is cut off: what does not fit side by side follows
    below, the first column once more beside it.
    """

    headings: Sequence[str]  # of the columns; a unit in brackets is text like the rest
    rows: Sequence[Sequence[Cell | str]]  # one cell a column each, a text or more than that
    title: str = ""  # above it
    caption: str = ""  # below it

    def __rich_console__(
        self, console: Console, options: ConsoleOptions
    ) -> Iterator[rich_table.Table | Text]:
        """Yield the parts that fit."""
        if self.title:
            yield Text(printable(self.title), "bold")
        for part in self._parts(options.max_width):
            yield self._table(part, options.max_width)
            yield Text()
        if self.caption:
            yield Text(f"{printable(self.caption)}\n", "dim")

    def _cells(self, column: int) -> list[str]:
        return [_text(row[column]) for row in self.rows]

    def _least(self, column: int) -> int:
        """Return the width below which a column reads badly."""
        lines = [line for cell in self._cells(column) for line in cell.splitlines()]
        words = [word for line in [self.headings[column], *lines] for word in line.split()]
        return max(map(len, [*words, *(line[:_WHOLE] for line in lines), "–"]))

    def _most(self, column: int) -> int:
        """Return the width at which nothing is broken."""
        lines = [line for cell in self._cells(column) for line in cell.splitlines()]
        return max(map(len, [self.headings[column], *lines]))

    def _parts(self, width: int) -> Iterator[list[int]]:
        part = [0]
        for column in range(1, len(self.headings)):
            if len(part) > 1 and _total([self._least(each) for each in [*part, column]]) > width:
                yield part
                part = [0]
            part.append(column)
        yield part

    def _table(self, part: Sequence[int], width: int) -> rich_table.Table:
        widths = self._widths(part, width)
        columns = [self._column(column, widths[column]) for column in part]
        tall = any("\n" in cell or len(cell) > widths[each] for each in part for cell in self._cells(each))
        table = rich_table.Table(*columns, leading=int(tall), **_FRAME)
        for row in self.rows:
            table.add_row(*(Text(_text(row[column])) for column in part))
        return table

    def _widths(self, part: Sequence[int], width: int) -> dict[int, int]:
        """Return the columns' widths: the widest gives way first, down to where it reads badly."""
        widths = {column: self._most(column) for column in part}
        while _total(list(widths.values())) > width:
            slack = [column for column in part if widths[column] > self._least(column)]
            widest = max(slack or part, key=lambda column: widths[column])
            if widths[widest] == 1:
                break
            widths[widest] -= 1
        return widths

    def _column(self, column: int, width: int) -> rich_table.Column:
        cells = self._cells(column)
        numbers = all(map(_NUMBER.fullmatch, cells)) and any(map(str.strip, "".join(cells).strip("–")))
        heading, side = Text(printable(self.headings[column])), "right" if numbers else "left"
        return rich_table.Column(heading, width=width, overflow="fold", justify=side)


def _text(cell: Cell | str) -> str:
    return str(cell) if isinstance(cell, Cell) else printable(cell)


def _total(widths: Sequence[int]) -> int:
    return sum(widths) + _GAP * (len(widths) - 1)
