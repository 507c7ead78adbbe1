"""The pieces of HTML that reports are made of, as `pieces.jinja` has them; whatever goes in is escaped."""

from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any

from handrail.datasets.presentation.table import Table
from handrail.datasets.printable import printable


@cache
def _pieces() -> Any:
    """Return the module of the pieces; whatever they print is no markup and steers nobody."""
    from jinja2 import Environment, FileSystemLoader
    from markupsafe import Markup

    def shown(value: Any) -> Any:
        return value if isinstance(value, Markup) else printable(str(value), "\n")

    loader = FileSystemLoader(Path(__file__).parent)
    environment = Environment(loader=loader, autoescape=True, finalize=shown, keep_trailing_newline=True)
    return environment.get_template("pieces.jinja").module


def _piece(name: str, *given: Any) -> str:
    return str(getattr(_pieces(), name)(*given))


def page(title: str, *parts: str | Table, what: str = "") -> str:
    """Return a whole page that needs nothing else: its title, what it is about, and its parts."""
    return _piece("page", title, parts, what)


def section(title: str, *parts: str | Table) -> str:
    """Return a section, with a heading if it has a title."""
    return _piece("section", title, parts)


def table(shown: Table) -> str:
    """Return a table, its title above and its caption below."""
    return _piece("table", shown)


def film(address: str) -> str:
    """Return a video."""
    return _piece("film", address)


def items(texts: Iterable[tuple[str, str]]) -> str:
    """Return a list of texts, each with a class of the style."""
    return _piece("items", texts)


def paragraph(text: str, look: str = "") -> str:
    """Return a paragraph."""
    return _piece("paragraph", text, look)


def panels(shown: Iterable[tuple[str, str, str]], look: str = "") -> str:
    """Return figures side by side as the page has room, each below its title.

    Args:
        shown: Title, note and address of each.
        look: `small` or `wide`; "" for half the page.
    """
    return _piece("panels", figures, look) if (figures := list(shown)) else ""


def legend(colours: Iterable[tuple[str, str]]) -> str:
    """Return which colour is whose."""
    return _piece("legend", colours)


def gallery(pictures: Iterable[tuple[str, str]]) -> str:
    """Return small pictures with captions."""
    return _piece("gallery", shown) if (shown := list(pictures)) else ""


def card(title: str, colour: str, big: str, lines: Iterable[str]) -> str:
    """Return a card with one large number."""
    return _piece("card", title, colour, big, lines)


def cards(shown: Iterable[str]) -> str:
    """Return cards side by side."""
    return _piece("cards", shown)


def folded(summary: str, content: str) -> str:
    """Return what opens when asked for."""
    return _piece("folded", summary, content)
