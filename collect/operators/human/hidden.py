"""What a scripted operator has in mind that no observation says; each part declares its own."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

Drawn = Literal["never", "once a recording", "as an episode begins", "all the time"]


@dataclass(frozen=True)
class Hidden:
    """A piece of hidden state.

    Attributes:
        what: it is.
        size: how large, or how long it lasts.
        drawn: when chance has a say in it; never, where it follows from what was seen.
        seen: what tells a policy of it.
    """

    what: str
    size: str
    drawn: Drawn
    seen: str


def declared(part: object) -> Mapping[str, Hidden]:
    """Return the hidden attributes that the classes of a part declare in `HIDDEN`, by name."""
    kinds = reversed(type(part).__mro__)
    return {name: piece for kind in kinds for name, piece in vars(kind).get("HIDDEN", {}).items()}


def parts_of(operator: object) -> Iterator[object]:
    """Yield an operator, and the parts of it that have attributes of their own to declare."""
    yield operator
    for value in vars(operator).values():
        if hasattr(type(value), "HIDDEN"):
            yield from parts_of(value)


def hidden_table(operators: Mapping[str, Any]) -> str:
    """Return a table of all that is hidden, in Markdown.

    Args:
        operators: by teleop mode, each with an episode begun.
    """
    modes: dict[Hidden, list[str]] = {}
    for mode, operator in operators.items():
        for piece in {piece: None for part in parts_of(operator) for piece in declared(part).values()}:
            modes.setdefault(piece, []).append(mode)
    lines = ["| what | modes | how large | drawn | does a policy see it |", "|---|---|---|---|---|"]
    for piece, names in modes.items():
        known = "all" if len(names) == len(operators) else ", ".join(f"`{name}`" for name in names)
        lines.append(f"| {piece.what} | {known} | {piece.size} | {piece.drawn} | {piece.seen} |")
    return "\n".join(lines)
