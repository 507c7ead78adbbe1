"""The few pieces of HTML that a report is made of; everything that goes in is escaped."""

from collections.abc import Iterable
from html import escape as escaped

from handrail.datasets.presentation.table import Cell, Table
from handrail.datasets.printable import printable

_CSS = """
:root { --ink: #1d2733; --quiet: #5d6874; --line: #e3e7ec; --paper: #ffffff; --wash: #f6f8fa; }
* { box-sizing: border-box; }
body { margin: 0; background: var(--wash); color: var(--ink);
  font: 15px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", sans-serif; }
main { max-width: 1180px; margin: 0 auto; padding: 22px 20px 60px; }
header p { margin: 0; color: var(--quiet); }
h1 { font-size: 22px; margin: 0; }
h2 { font-size: 18px; margin: 34px 0 10px; }
h3 { font-size: 14.5px; margin: 18px 0 6px; }
video { max-width: 100%; border-radius: 6px; }
section { background: var(--paper); border: 1px solid var(--line); border-radius: 10px; padding: 16px 18px;
  margin: 12px 0; }
section > h2:first-child { margin-top: 0; }
.headline { font-size: 19px; line-height: 1.4; font-weight: 600; margin: 14px 0 12px; }
.cards { display: flex; flex-wrap: wrap; gap: 12px; margin: 12px 0; }
.card { flex: 1 1 220px; background: var(--paper); border: 1px solid var(--line); border-radius: 10px;
  border-top: 5px solid var(--colour); padding: 10px 14px; }
.card h3 { margin: 0 0 4px; font-size: 15px; }
.card .big { font-size: 27px; font-weight: 700; line-height: 1.15; }
.card small { color: var(--quiet); display: block; }
.panels { display: grid; gap: 14px; grid-template-columns: repeat(auto-fit, minmax(420px, 1fr)); }
.panels.small { grid-template-columns: repeat(auto-fill, minmax(240px, 1fr)); margin-top: 14px; }
.panels.wide { grid-template-columns: 1fr; }
.panels img { width: 100%; height: auto; display: block; }
.panels figcaption { margin: 4px 0; overflow-wrap: anywhere; }
.panels strong { color: var(--ink); font-size: 13.5px; }
.panels.small strong { font-size: 12.5px; }
.legend { display: flex; flex-wrap: wrap; gap: 2px 16px; margin: 0 0 6px; font-size: 13px; }
.legend i { display: inline-block; width: 11px; height: 11px; border-radius: 50%; margin-right: 6px; }
h1, h3, .headline, .legend { overflow-wrap: anywhere; }
td:first-child { overflow-wrap: break-word; min-width: 96px; max-width: 240px; }
table { border-collapse: collapse; width: 100%; font-size: 13.5px; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: 5px 10px 5px 0; border-bottom: 1px solid var(--line);
  vertical-align: top; }
th { color: var(--quiet); font-weight: 600; }
td.detected { font-weight: 700; }
td small { display: block; color: var(--quiet); font-weight: 400; font-size: 11px; }
td:not(:first-child) small { white-space: nowrap; }
td.quiet, .quiet { color: var(--quiet); }
.wide { overflow-x: auto; }
ul { margin: 6px 0; padding-left: 20px; }
li { margin: 4px 0; }
li.detected::marker { color: #0072b2; content: "●  "; }
li.caution::marker { content: "!  "; font-weight: 700; color: #d55e00; }
.pictures { display: flex; flex-wrap: wrap; gap: 10px; }
figure { margin: 0; } figcaption { font-size: 12px; color: var(--quiet); }
details summary { cursor: pointer; color: var(--quiet); }
@media (max-width: 900px) { main { padding: 14px 10px 40px; } section { padding: 12px; }
  table { font-size: 12px; } th, td { padding: 4px 7px 4px 0; } td small { font-size: 10px; }
  .panels { grid-template-columns: 1fr; } .panels.small { grid-template-columns: 1fr 1fr; } }
@media print { body { background: #fff; } section, .card { break-inside: avoid; } }
"""


def escape(text: str) -> str:
    """Return a text that is no markup, wherever it stands in a page."""
    return escaped(printable(text, "\n"))


def page(title: str, *parts: str | Table, what: str = "") -> str:
    """Return a whole page that needs nothing else: its title, what it is about, and its parts."""
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f'<meta name="viewport" content="width=device-width, initial-scale=1"><style>{_CSS}</style></head>'
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
