"""From the bytes of a terminal to keys: plain ones, escape sequences in pieces, kitty's keyboard protocol."""

import re
from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

Change = Literal["down", "again", "up"]
FOCUS_IN, FOCUS_OUT = "focus_in", "focus_out"
TELLS_RELEASES, THERE, INTERRUPT = "tells_releases", "there", "interrupt"
_ESCAPE = 0x1B
_ALONE = 0.05  # after that, an Escape is the key and no sequence [s]
_LONGEST = 64  # of a sequence [bytes]
_MOST = 8  # plain characters at once: more are pasted, not typed
_SEQUENCE = re.compile(rb"\x1b([O[])([0-?]*)[!-/]*([@-~]?)")  # without the last one it has no end yet
_ARROWS = {b"A": "up", b"B": "down", b"C": "right", b"D": "left"}
_NAMED = {9: "tab", 10: "enter", 13: "enter", 27: "escape", 127: "backspace", 8: "backspace"}
_NAMED |= dict.fromkeys((0, 32, 0xA0, 0xAF, 0x202F), "space")  # with Control 0, with Alt no-break ones
_CHANGES: dict[str, Change] = {"1": "down", "2": "again", "3": "up"}
_ALT, _CONTROL = 2, 4  # bits of the modifiers
NAMES = frozenset({*_NAMED.values(), *_ARROWS.values(), *(chr(code).lower() for code in range(0x21, 0x7F))})


@dataclass(frozen=True)
class Key:
    """An event of a key, or what a terminal says that is no key (`FOCUS_IN`, `THERE`, …)."""

    name: str
    """The character, or a name such as `enter`."""
    change: Change = "down"
    """A terminal that does not tell releases says `down` again and again while a key is held."""
    is_chord: bool = False  # whether Alt or Control went with it


class KeyBytes:
    """Takes bytes as they come, and says which keys they are; pasted text is none, nor is one with Alt.

    Args:
        stops: keys that are never kept back, pasted or not, whatever is held with them.
    """

    def __init__(self, stops: Collection[str] = ("space",)) -> None:
        self._stops, self._rest, self._since = stops, b"", 0.0

    def take(self, data: bytes, now: float) -> list[Key]:
        """Return the keys in what came now [s]; what is not whole yet waits for more."""
        self._since = now if data else self._since
        self._rest += data
        keys: list[tuple[Key, bool]] = []
        while self._rest:
            size, key = self._first(waits=now - self._since < _ALONE)
            if not size:
                break
            if key and (key.name in self._stops or not key.is_chord):
                keys.append((key, self._rest[0] != _ESCAPE))
            self._rest = self._rest[size:]
        is_pasted = sum(is_typed for _, is_typed in keys) > _MOST
        return [key for key, is_typed in keys if key.name in self._stops or not (is_pasted and is_typed)]

    def _first(self, waits: bool) -> tuple[int, Key | None]:
        """Return how many bytes the first key has, 0 while it waits for more, and the key, None of no key."""
        rest = self._rest
        if rest[0] != _ESCAPE:
            return 1, _of_code(rest[0])
        if found := _SEQUENCE.match(rest):
            size = found.end()  # what cannot belong to it comes after it
            more = waits and not found[3] and size == len(rest) < _LONGEST
            return (0, None) if more else (size, _of_sequence(found[1], found[2].decode(), found[3]))
        if rest == b"\x1b":
            return (0, None) if waits else (1, Key("escape"))
        return (1, Key("escape")) if rest[1] == _ESCAPE else (2, _of_code(rest[1], _ALT))


def _of_sequence(kind: bytes, parameters: str, final: bytes) -> Key | None:
    """Return what a sequence `ESC kind parameters final` says; None where it is no key that is known."""
    if kind == b"[" and parameters == "" and final in (b"I", b"O"):
        return Key(FOCUS_IN if final == b"I" else FOCUS_OUT)
    if final == b"u" and parameters.startswith("?"):
        return Key(TELLS_RELEASES)
    if final in (b"n", b"c"):
        return Key(THERE)
    code, _, rest = parameters.partition(";")
    modifiers, _, change = rest.partition(";")[0].partition(":")
    how, number = _CHANGES.get(change or "1"), code.partition(":")[0]
    if how is None:
        return None
    if final in _ARROWS:
        return Key(_ARROWS[final], how)
    if final != b"u" or not number.isdigit():
        return None
    return _of_code(int(number), int(modifiers) - 1 if modifiers.isdigit() else 0, how)


def _of_code(code: int, modifiers: int = 0, change: Change = "down") -> Key | None:
    """Return a key by its character, or its number in kitty's protocol."""
    if modifiers & _CONTROL and code == ord("c") and change != "up":
        return Key(INTERRUPT)
    is_chord = bool(modifiers & (_ALT | _CONTROL)) and change != "up"
    name = _NAMED.get(code) or (chr(code).lower() if 0x20 < code < 0x7F else "")
    return Key(name, change, is_chord) if name else None
