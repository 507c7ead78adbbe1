"""Markdown: tables, and the part of a page that a command writes: between two marks, other text stays."""

import re
from html import escape
from pathlib import Path

from handrail.controllers.errors import HandrailError
from handrail.datasets.presentation.table import Cell, Table
from handrail.datasets.printable import printable
from handrail.datasets.storage.atomic import write_whole

_TAG = re.compile(r"<(?=[a-z/!?])|&(?=#?\w+;)", re.IGNORECASE)
_LIVE = re.compile(r"[\\`*|~]|(?<![^\W_])_|_(?![^\W_])|](?=[(\[:])|(?<=:)/(?=/)|(?<=www)\.", re.IGNORECASE)


def markdown_table(table: Table) -> str:
    """Return a table as Markdown, its title above."""
    rows = [
        [_cell(cell) for cell in row] for row in (table.headings, ["---"] * len(table.headings), *table.rows)
    ]
    lines = "\n".join("| " + " | ".join(row) + " |" for row in rows)
    return f"**{markdown_text(table.title)}**\n\n{lines}" if table.title else lines


def _cell(cell: Cell | str) -> str:
    if isinstance(cell, Cell):
        cell = f"{cell.text} ({cell.below})" if cell.below else cell.text
    return markdown_text(cell)


def markdown_text(text: str) -> str:
    """Return a text that is shown as it is in the middle of a line: no tag, link, picture, code or cell."""
    return _LIVE.sub(r"\\\g<0>", _TAG.sub(lambda found: escape(found[0]), printable(text)))


def read_page(page: Path, heading: str = "") -> str:
    """Return the text of a page; a heading if there is no page yet."""
    try:
        return page.read_text(encoding="utf-8") if page.exists() else f"# {heading}\n"
    except (OSError, UnicodeDecodeError) as error:
        raise HandrailError(f"--page {page}: expected a text in UTF-8, got {error}") from error


def write_part(page: Path, heading: str, label: str, body: str) -> None:
    """Write a part of a page, which is made if need be."""
    write_whole(page, with_part(read_page(page, heading), label, body).encode())


def with_part(text: str, label: str, body: str) -> str:
    """Return a page's text with the body between the label's marks; at its end where there are none."""
    begin, end = f"<!-- {label} -->", f"<!-- end of {label} -->"
    block = f"{begin}\n\n{body}\n\n{end}"
    name = re.escape(label)
    begins = list(re.finditer(f"<!-- {name} -->", text))
    ends = list(re.finditer(f"<!-- end of {name} -->", text))
    if not begins and not ends:
        return f"{text.rstrip()}\n\n{block}\n"
    if (len(begins), len(ends)) != (1, 1) or begins[0].end() > ends[0].start():
        raise HandrailError(
            f"--page: expected {begin} and {end} once each, in this order, or neither; "
            f"got {len(begins)} and {len(ends)}"
        )
    return text[: begins[0].start()] + block + text[ends[0].end() :]
