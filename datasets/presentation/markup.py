"""The few pieces of HTML that a report is made of; everything that goes in is escaped."""

from collections.abc import Iterable
from html import escape

from handrail.datasets.presentation.style import CSS
from handrail.datasets.presentation.table import Cell, Table


def page(title: str, *parts: str | Table, what: str = "") -> str:
    """Return a whole page that needs nothing else: its title, what it is about, and its parts."""
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f'<meta name="viewport" content="width=device-width, initial-scale=1"><style>{CSS}</style></head>'
        f"<body><main><header><h1>{escape(title)}</h1>{paragraph(what) if what else ''}</header>"
        f"{_joined(parts)}</main></body></html>\n"
    )


def section(title: str, *parts: str | Table) -> str:
    """Return a section, with a heading if it has a title."""
    return f"<section>{f'<h2>{escape(title)}</h2>' if title else ''}{_joined(parts)}</section>"


def _joined(parts: Iterable[str | Table]) -> str:
    return "".join(part if isinstance(part, str) else table(part) for part in parts)


def table(shown: Table) -> str:
    """Return a table, its title above and its caption below."""
    title = f"<h3>{escape(shown.title)}</h3>" if shown.title else ""
    head = "".join(f"<th>{escape(heading)}</th>" for heading in shown.headings)
    body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in shown.rows)
    caption = paragraph(shown.caption, "quiet") if shown.caption else ""
    rows = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    return f'{title}<div class="wide">{rows}</div>{caption}'


def _cell(cell: Cell | str) -> str:
    cell = Cell(cell) if isinstance(cell, str) else cell
    look = f' class="{cell.look}"' if cell.look else ""
    note = f' title="{escape(cell.note)}"' if cell.note else ""
    below = f"<small>{escape(cell.below)}</small>" if cell.below else ""
    return f"<td{look}{note}>{escape(cell.text)}{below}</td>"


def film(address: str) -> str:
    """Return a video."""
    return f'<video controls muted loop src="{address}"></video>'


def link(text: str, address: str) -> str:
    """Return a paragraph that leads somewhere."""
    return f'<p><a href="{escape(address)}">{escape(text)}</a></p>'


def items(texts: Iterable[tuple[str, str]]) -> str:
    """Return a list of texts, each with a class of the style."""
    return "<ul>" + "".join(f'<li class="{look}">{escape(text)}</li>' for look, text in texts) + "</ul>"


def paragraph(text: str, look: str = "") -> str:
    """Return a paragraph."""
    return f'<p class="{look}">{escape(text)}</p>' if look else f"<p>{escape(text)}</p>"


def panels(shown: Iterable[tuple[str, str, str]], look: str = "") -> str:
    """Return figures side by side as the page has room, each below its title.

    Args:
        shown: Title, note and address of each.
        look: `small` or `wide`; "" for half the page.
    """
    figures = "".join(
        f"<figure><figcaption><strong>{escape(title)}</strong> {escape(note)}</figcaption>"
        f'<img src="{address}" alt="{escape(title)}"></figure>'
        for title, note, address in shown
    )
    return f'<div class="panels {look}">{figures}</div>' if figures else ""


def legend(colours: Iterable[tuple[str, str]]) -> str:
    """Return which colour is whose."""
    marks = (f'<span><i style="background: {colour}"></i>{escape(label)}</span>' for label, colour in colours)
    return f'<p class="legend">{"".join(marks)}</p>'


def gallery(pictures: Iterable[tuple[str, str]]) -> str:
    """Return small pictures with captions."""
    shown = "".join(
        f'<figure><img src="{address}" alt="{escape(caption)}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
        for caption, address in pictures
    )
    return f'<div class="pictures">{shown}</div>' if shown else ""


def card(title: str, colour: str, big: str, lines: Iterable[str]) -> str:
    """Return a card with one large number."""
    small = "".join(f"<small>{escape(line)}</small>" for line in lines)
    return (
        f'<div class="card" style="--colour: {colour}"><h3>{escape(title)}</h3>'
        f'<div class="big">{escape(big)}</div>{small}</div>'
    )


def cards(shown: Iterable[str]) -> str:
    """Return cards side by side."""
    return f'<div class="cards">{"".join(shown)}</div>'


def folded(summary: str, content: str) -> str:
    """Return what opens when asked for."""
    return f"<details><summary>{escape(summary)}</summary>{content}</details>"
