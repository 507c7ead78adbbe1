"""The words of the page for how far the hand is from where it is to be brought, and the keys for them."""

import re

import numpy as np

_AXES = (
    ("backward", "forward"),
    ("right", "left"),
    ("down", "up"),
    ("roll left", "roll right"),
    ("tip up", "tip down"),
    ("turn right", "turn left"),
)
_KEYS = ("SW", "DA", "FR", "ZX", "TG", "EQ")
_WORDS = re.compile(r"(\w+): [\d.]+ cm away(?: ✓)?(?:: ([^·]*))?(?: ?· turned (\d+)°(?: ✓)?(?:: (.*))?)?")
_UNITS = np.array([0.01] * 3 + [np.pi / 180.0] * 3)  # of a centimetre and a degree [m, rad]


def way(words):
    """Return where the hand is to be brought, by name, and what is left of way and turn, (6,) [m, rad]."""
    found = _WORDS.fullmatch(words.strip())
    if not found:
        return "", np.zeros(6)
    error = np.zeros(6)
    for part in filter(None, f"{found[2] or ''}, {found[4] or ''}".split(",")):
        if part.strip():
            axis, number = part.strip().rsplit(" ", 1)
            index = next(index for index, both in enumerate(_AXES) if axis in both)
            error[index] = float(number) * (1.0 if axis == _AXES[index][1] else -1.0)
    return found[1], _UNITS * error


def keys(error, near=0.04, angle=0.15):
    """Return the keys of the hand to hold: for what is farther than a distance [m], or an angle [rad]."""
    far = np.abs(error) > [near] * 3 + [angle] * 3
    return {f"Key{both[int(x > 0)]}" for both, x, is_far in zip(_KEYS, error, far, strict=True) if is_far}


def way_of(key):
    """Return which way a key moves the hand, (6,); none for another key."""
    return np.array([both.find(key[-1]) * 2.0 - 1.0 if key[-1] in both else 0.0 for both in _KEYS])
