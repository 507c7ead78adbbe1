"""Disturbances of an episode: pushes, a start elsewhere, late observations, other pictures. Light to import.

All of it is drawn from the episode's seed and from nothing that the robot does, so that whoever runs the same
seed meets the same disturbance.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from handrail.controllers.errors import HandrailError, unknown_name
from handrail.controllers.typed import check_settings

NONE = "none"
DEFAULTS: Mapping[str, float] = {"push": 1.0, "shift": 0.3, "delay": 3, "camera": 1.0, "blank": 1, "swap": 1}
_WORDS = {
    "push": "pushed",
    "shift": "shifted",
    "delay": "delayed",
    "camera": "camera moved",
    "blank": "cameras blank",
    "swap": "pictures of another episode",
}
PICTURES = ("camera", "blank", "swap")  # those that change what cameras see, and nothing else


@dataclass(frozen=True)
class Perturbation:
    """How much an episode is disturbed, each way; 0 is not at all."""

    push: Annotated[float, Meta(ge=0, le=10)] = 0.0
    """Strength of the pushes on base and hand; 1 is that of `collect/session/disturbances.py`."""
    shift: Annotated[float, Meta(ge=0, le=2)] = 0.0
    """How far from the demonstrations' start the robot begins at most [m, rad]."""
    delay: Annotated[int, Meta(ge=0, le=100)] = 0  # control periods by which observations come late
    camera: Annotated[float, Meta(ge=0, le=10)] = 0.0  # each is moved by 2 cm and turned by 3°, times this
    blank: Annotated[int, Meta(ge=0, le=1)] = 0  # whether pictures are black
    swap: Annotated[int, Meta(ge=0, le=1)] = 0  # whether pictures are of another episode's scene

    def __post_init__(self) -> None:
        """Check the sizes."""
        check_settings(self, "--perturbation")
        if self.blank and self.swap:
            raise HandrailError("--perturbation: expected blank or swap, got both")

    @classmethod
    def parse(cls, text: str) -> "Perturbation":
        """Return what `none`, `push`, `push:2` or `push+delay:5` says."""
        sizes: dict[str, float] = {}
        for part in text.strip().split("+") if text.strip() != NONE else ():
            name, _, number = part.strip().partition(":")
            if name not in DEFAULTS:
                raise unknown_name("perturbation", name, (NONE, *DEFAULTS))
            try:
                size = float(number or DEFAULTS[name])
            except ValueError:
                size = 0.0
            if not size > 0.0:
                raise HandrailError(f"--perturbation {name}:{number}: expected a number above 0")
            if name in sizes:
                raise HandrailError(f"--perturbation {text}: expected each of {', '.join(DEFAULTS)} once")
            sizes[name] = int(size) if isinstance(DEFAULTS[name], int) and size.is_integer() else size
        return cls(**sizes)  # type: ignore[arg-type]

    @property
    def sizes(self) -> dict[str, float]:
        """The disturbance, with its size."""
        return {name: float(getattr(self, name)) for name in DEFAULTS if getattr(self, name)}

    @property
    def text(self) -> str:
        """What `parse` reads, sizes written out."""
        return "+".join(f"{name}:{size:g}" for name, size in self.sizes.items()) or NONE

    @property
    def words(self) -> str:
        """The name of a condition under it, such as `pushed delayed:5`; usual sizes are not said."""
        return " ".join(
            _WORDS[name] + ("" if size == DEFAULTS[name] else f":{size:g}")
            for name, size in self.sizes.items()
        )
