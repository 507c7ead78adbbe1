"""What a scripted operator has in mind that no observation says; each part declares its own."""

from dataclasses import dataclass
from typing import Literal

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
