"""Tables in Markdown, and the part of a page that a command writes: between two marks, other text stays."""

from collections.abc import Sequence

Table = tuple[Sequence[str], Sequence[Sequence[str]]]  # headings, rows


def markdown_table(table: Table) -> str:
    """Return a table as Markdown."""
    headings, rows = table
    lines = [headings, ["---"] * len(headings), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def with_part(text: str, label: str, body: str) -> str:
    """Return a page's text with the body between the label's marks; at its end where there are none."""
    begin, end = f"<!-- {label} -->", f"<!-- end {label} -->"
    block = f"{begin}\n\n{body}\n\n{end}"
    before, found, rest = text.partition(begin)
    if not found:
        return f"{text.rstrip()}\n\n{block}\n"
    return before + block + rest.partition(end)[2]
