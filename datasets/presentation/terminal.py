"""The terminal, through which all goes that a command prints: no text can steer it."""

from collections.abc import Iterable
from typing import Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.text import Text

from handrail.datasets.printable import printable


class Terminal(Console):
    """A console that shows a text in one line, as it is; control characters are written out.

    Args:
        stderr: whether it is standard error.
        quiet: whether it shows nothing.
    """

    def __init__(self, stderr: bool = False, quiet: bool = False) -> None:
        super().__init__(stderr=stderr, quiet=quiet, highlight=False, markup=False, emoji=False)

    def print(self, *objects: Any, **options: Any) -> None:
        """Print texts, each a line that is not broken, or what rich can draw."""
        is_text = all(isinstance(each, str) for each in objects)
        super().print(*objects, **{"soft_wrap": is_text, **options})

    def render_str(self, text: str, **options: Any) -> Text:
        """Return a text in one line."""
        return super().render_str(printable(text), **options)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Yield the pieces of anything; only rich's own may steer the terminal."""
        for piece in super().render(renderable, options):
            safe = piece.control or piece.text.isprintable()
            yield piece if safe else Segment(printable(piece.text, "\n"), piece.style)
