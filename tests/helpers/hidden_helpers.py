"""What the parts of a scripted operator declare as hidden, and the table of it in docs/concepts.md."""


def declared(part):
    """Return the hidden attributes that the classes of a part declare in `HIDDEN`, by name."""
    kinds = reversed(type(part).__mro__)
    return {name: piece for kind in kinds for name, piece in vars(kind).get("HIDDEN", {}).items()}


def parts_of(operator):
    """Yield an operator, and the parts of it that have attributes of their own to declare."""
    yield operator
    for value in vars(operator).values():
        if hasattr(type(value), "HIDDEN"):
            yield from parts_of(value)


def hidden_table(operators):
    """Return a table of all that is hidden, in Markdown.

    Args:
        operators: by teleop mode, each with an episode begun.
    """
    modes = {}
    for mode, operator in operators.items():
        for piece in {piece: None for part in parts_of(operator) for piece in declared(part).values()}:
            modes.setdefault(piece, []).append(mode)
    lines = ["| what | modes | how large | drawn | does a policy see it |", "|---|---|---|---|---|"]
    for piece, names in modes.items():
        known = "all" if len(names) == len(operators) else ", ".join(f"`{name}`" for name in names)
        lines.append(f"| {piece.what} | {known} | {piece.size} | {piece.drawn} | {piece.seen} |")
    return "\n".join(lines)
