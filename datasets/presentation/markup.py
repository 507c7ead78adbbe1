"""The pieces of HTML that reports are made of: the macros of `pieces.jinja`; whatever goes in is escaped.

A part of a page or a section is a piece that was made here, or a `Table`.
"""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

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


def _piece(name: str) -> Callable[..., str]:
    return lambda *given, **named: str(getattr(_pieces(), name)(*given, **named))


page = _piece("page")  # (title, *parts, what=""): a whole page that needs nothing else
section = _piece("section")  # (title, *parts): with a heading if it has a title
table = _piece("table")  # (Table): its title above and its caption below
items = _piece("items")  # (pairs of a class of the style and a text): a list
paragraph = _piece("paragraph")  # (text, look="")
panels = _piece("panels")  # (title, note, address of each figure, look=""): `small`, `wide`, or half a page
legend = _piece("legend")  # (pairs of a label and its colour)
gallery = _piece("gallery")  # (pairs of a caption and an address): small pictures
card = _piece("card")  # (title, colour, text in large, lines)
cards = _piece("cards")  # (cards): side by side
folded = _piece("folded")  # (summary, piece): what opens when asked for
