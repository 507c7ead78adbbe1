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
_KEYS = (("KeyS", "KeyW"), ("KeyD", "KeyA"), ("KeyF", "KeyR"), ("KeyZ", "KeyX"), ("KeyT", "KeyG"), ("KeyE", "KeyQ"))
_WORDS = re.compile(r"(\w+): [\d.]+ cm away(?: ✓)?(?:: ([^·]*))?(?:· turned (\d+)°(?: ✓)?(?:: (.*))?)?")
_UNITS = np.array([0.01] * 3 + [np.pi / 180.0] * 3)  # of a centimetre and a degree [m, rad]


def way(words):
    """Return what the hand is to be brought to, and way and turn that are left, (6,) [m, rad]; "" where nothing is."""
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


def is_turned(words):
    """Whether it matters how the hand is turned."""
    return "turned" in words


def keys(error, near=0.04, angle=0.15):
    """Return the keys of the hand to hold: for what is farther than a distance [m], or an angle [rad]."""
    far = np.abs(error) > [near] * 3 + [angle] * 3
    return {both[int(x > 0)] for both, x, is_far in zip(_KEYS, error, far, strict=True) if is_far}
