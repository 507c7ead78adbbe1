"""The inputs of a person's device: where they are now, and what they ask for."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any

from msgspec import Meta

MOST = 64  # values in a list
_Deflection = Annotated[float, Meta(ge=-1, le=1)]
_Angle = Annotated[float, Meta(ge=-20, le=20)]


@dataclass(frozen=True)
class Input:
    """Where the inputs are."""

    on: bool  # whether somebody holds the dead-man, and is there: a page seen, a device connected
    device: str  # what is moved
    grips: Annotated[tuple[bool, ...], Meta(max_length=MOST)]  # which grippers shall be closed, one a hand
    axes: Annotated[tuple[_Deflection, ...], Meta(max_length=MOST)]  # deflection of each channel, (m,)
    view: Annotated[float, Meta(ge=-10, le=10)]  # from where the person looks, about the vertical [rad]
    targets: Annotated[tuple[_Angle, ...], Meta(max_length=MOST)]
    """Where the arm's joints shall go, as a leader arm or sliders say it [rad]; empty while let go."""

    @property
    def is_let_go(self) -> bool:
        """Whether nothing is deflected."""
        return not any(self.axes) and not self.targets

    def let_go(self) -> "Input":
        """Return them with nothing deflected."""
        return replace(self, axes=(0.0,) * len(self.axes), targets=())


ASKS: Mapping[str, type] = {
    "start": bool,  # go on after a pause; begin
    "pause": bool,
    "stop": bool,  # the e-stop; false releases it
    "success": bool,
    "failure": bool,
    "discard": bool,
    "restart": bool,
    "quit": bool,
    "undo": bool,  # back to where they went on last, or the beginning
    "practice": bool,
    "mode": str,
    "mask": list,  # of channels that the operator wants to own, whatever the mode says
    "focus": str,
    "hand": str,  # the one of several that is steered now
    "frame": str,
    "speed": float,
    "lock": list,
}
STILLS = frozenset(("pause", "success", "failure", "discard", "restart", "quit", "undo"))  # leave it at rest


@dataclass(frozen=True)
class Ask:
    """A request that counts once: one of `ASKS`, and how much of it."""

    what: str
    value: Any = True
