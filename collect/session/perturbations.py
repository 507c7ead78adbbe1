"""What may disturb an episode: pushes, a start elsewhere, late observations. Light to import.

All of it is drawn from the episode's seed and from nothing that the robot does, so that whoever runs the same
seed meets the same disturbance.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from handrail.controllers.errors import HandrailError, unknown_name

NONE = "none"
DEFAULTS: Mapping[str, float] = {"push": 1.0, "shift": 0.3, "delay": 3.0}
MOST: Mapping[str, float] = {"push": 10.0, "shift": 2.0, "delay": 100.0}
_WORDS = {"push": "pushed", "shift": "shifted", "delay": "delayed"}


@dataclass(frozen=True)
class Perturbation:
    """How much an episode is disturbed, each way; 0 is not at all.

    Attributes:
        push: strength of the pushes on base and hand; 1 is that of `collect/session/disturbances.py`.
        shift: how far from the demonstrations' start the robot begins at most [m, rad].
        delay: control periods by which observations come late.
    """

    push: float = 0.0
    shift: float = 0.0
    delay: int = 0

    @classmethod
    def parse(cls, text: str) -> "Perturbation":
        """Return what `none`, `push`, `push:2` or `push+delay:5` says."""
        sizes: dict[str, float] = {}
        for part in text.strip().split("+") if text.strip() != NONE else ():
            name, _, number = part.strip().partition(":")
            if name in sizes:
                raise HandrailError(f"--perturbation {text}: expected each of {', '.join(DEFAULTS)} once")
            sizes[name] = _size(name, number)
        delay = int(sizes.pop("delay", 0))
        return cls(**sizes, delay=delay)

    @property
    def sizes(self) -> dict[str, float]:
        """What disturbs, with its size."""
        return {name: float(getattr(self, name)) for name in DEFAULTS if getattr(self, name)}

    @property
    def text(self) -> str:
        """What `parse` reads, sizes written out."""
        return "+".join(f"{name}:{size:g}" for name, size in self.sizes.items()) or NONE

    @property
    def words(self) -> str:
        """What an arm is called under it, such as `pushed delayed:5`; usual sizes are not said."""
        return " ".join(
            _WORDS[name] + ("" if size == DEFAULTS[name] else f":{size:g}")
            for name, size in self.sizes.items()
        )


def _size(name: str, number: str) -> float:
    if name not in DEFAULTS:
        raise unknown_name("perturbation", name, (NONE, *DEFAULTS))
    if not number:
        return DEFAULTS[name]
    try:
        size = float(number)
    except ValueError:
        size = float("nan")
    whole = name != "delay" or size == int(size if size == size else 0)
    if not (0.0 < size <= MOST[name] and whole):
        kind = "a whole number of control periods" if name == "delay" else "a number"
        raise HandrailError(
            f"--perturbation {name}:{number}: expected {kind} above 0, at most {MOST[name]:g}"
        )
    return size
