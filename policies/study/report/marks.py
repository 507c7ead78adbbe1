"""A study's part of a Markdown page: between two marks; what is outside them is the reader's own."""

from pathlib import Path

from handrail.controllers.errors import HandrailError

_NEW = "# Teleoperation modes\n"


def read_page(page: Path) -> str:
    """Return the text of a page; a heading if there is none yet.

    Raises:
        HandrailError: it is no text.
    """
    try:
        return page.read_text(encoding="utf-8") if page.exists() else _NEW
    except (OSError, UnicodeDecodeError) as error:
        raise HandrailError(f"--page {page}: expected a text in UTF-8, got {error}") from error


def between_marks(text: str, name: str, body: str) -> str:
    """Return a page with a study's part replaced, or added at the end if it has none.

    Args:
        text: of the page.
        name: of the study.
        body: its part.

    Raises:
        HandrailError: the marks are not a pair, so that nobody knows what may go.
    """
    begin, end = f"<!-- study {name} -->", f"<!-- end of study {name} -->"
    counts = text.count(begin), text.count(end)
    if counts == (0, 0):
        return f"{text.rstrip()}\n\n{begin}\n\n{body}\n\n{end}\n"
    before, _, rest = text.partition(begin)
    if counts != (1, 1) or end not in rest:
        raise HandrailError(
            f"--page: expected {begin} and {end} once each, in this order, or neither; "
            f"got {counts[0]} and {counts[1]}"
        )
    return f"{before}{begin}\n\n{body}\n\n{end}{rest.partition(end)[2]}"
