"""What a report says: a sentence or two, and what kind of thing it says."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """One sentence or two.

    Attributes:
        kind: `outcome`, `collection`, `quality` or `caution`.
        text: What to read.
        detected: Whether it is a difference that was detected.
        short: The beginning of the text, for a headline.
    """

    kind: str
    text: str
    detected: bool = False
    short: str = ""
