"""The shape of a stick: nothing near its middle, then fine, then full."""

from dataclasses import dataclass


@dataclass(frozen=True)
class StickShape:
    """Dead zone and curve: `y = sign(x) ((|x| − d) / (1 − d))^p` where |x| ≥ d, else 0.

    Attributes:
        dead_zone: d, from 0 to 0.5.
        exponent: p, from 1 to 3.
    """

    dead_zone: float = 0.12
    exponent: float = 1.7

    def __call__(self, raw: float) -> float:
        """Return the deflection of a raw one, from −1 to 1; of what is no number, 0."""
        size = min(abs(raw), 1.0)
        if not size > self.dead_zone:
            return 0.0
        curved = ((size - self.dead_zone) / (1.0 - self.dead_zone)) ** self.exponent
        return curved if raw > 0 else -curved
