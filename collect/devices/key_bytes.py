"""From the bytes of a terminal to keys: plain ones, escape sequences in pieces, kitty's keyboard protocol."""

import re
from dataclasses import dataclass
from typing import Literal

Change = Literal["down", "again", "up"]
FOCUS_IN, FOCUS_OUT = "focus_in", "focus_out"
TELLS_RELEASES, THERE, INTERRUPT = "tells_releases", "there", "interrupt"
SIGNALS = (FOCUS_IN, FOCUS_OUT, TELLS_RELEASES, THERE, INTERRUPT)  # what a terminal says that is no key
_ESCAPE = 0x1B
_ALONE = 0.05  # after that, an Escape is the key and no sequence [s]
_LONGEST = 64  # of a sequence [bytes]
_MOST = 8  # plain characters at once: more are pasted, not typed
_CSI = re.compile(rb"\x1b\[([0-?]*)[ -/]*([@-~])")
_SS3 = re.compile(rb"\x1bO([A-Z])")
_ARROWS = {b"A": "up", b"B": "down", b"C": "right", b"D": "left"}
_NAMED = {9: "tab", 10: "enter", 13: "enter", 27: "escape", 32: "space", 127: "backspace", 8: "backspace"}
_CHANGES: dict[str, Change] = {"1": "down", "2": "again", "3": "up"}
_CONTROL = 4  # bit of the modifiers
NAMES = frozenset({*_NAMED.values(), *_ARROWS.values(), *(chr(code).lower() for code in range(0x21, 0x7F))})


@dataclass(frozen=True)
class Key:
    """What happened to a key, or one of `SIGNALS`.

    Attributes:
        name: the character, or a name such as `enter`.
        change: a terminal that does not tell releases says `down` again and again while a key is held.
    """

    name: str
    change: Change = "down"


class KeyBytes:
    """Takes bytes as they come, and says which keys they are.

    Attributes:
        dropped: sequences and pasted text that are no keys.
    """

    def __init__(self) -> None:
        self._rest, self._since = b"", 0.0
        self.dropped = 0

    def take(self, data: bytes, now: float) -> list[Key]:
        """Return the keys in what came now [s]; what is not whole yet waits for more."""
        if data:
            self._since = now
        self._rest += data
        keys: list[Key] = []
        typed: list[Key] = []
        while self._rest:
            found = self._next(now, typed, keys)
            if not found:
                break
            self._rest = self._rest[found:]
        if len(typed) > _MOST:
            self.dropped += len(typed)
            return [key for key in keys if key not in typed]
        return keys

    def _next(self, now: float, typed: list[Key], keys: list[Key]) -> int:
        """Take what comes first; return how many bytes it has, 0 if the rest of it is not there yet."""
        if self._rest[0] != _ESCAPE:
            return self._character(typed, keys)
        if found := _CSI.match(self._rest):
            key = _of_sequence(found[1].decode(), found[2])
        elif found := _SS3.match(self._rest):
            key = Key(_ARROWS[found[1]]) if found[1] in _ARROWS else None
        else:
            return self._unfinished(now, keys)
        if key is None:
            self.dropped += 1
        else:
            keys.append(key)
        return found.end()

    def _unfinished(self, now: float, keys: list[Key]) -> int:
        """Take an Escape that no known sequence follows."""
        rest = self._rest
        if rest == b"\x1b":
            if now - self._since < _ALONE:
                return 0
            keys.append(Key("escape"))
            return 1
        if rest[1:2] in (b"[", b"O"):
            if len(rest) < _LONGEST and now - self._since < _ALONE:
                return 0
            self.dropped += 1
            return len(rest)
        if rest[1] == _ESCAPE:
            keys.append(Key("escape"))
            return 1
        self.dropped += 1  # a key with Alt
        return 2

    def _character(self, typed: list[Key], keys: list[Key]) -> int:
        first = self._rest[0]
        if first in _NAMED:
            keys.append(Key(_NAMED[first]))
            typed.append(keys[-1])
        elif 0x20 < first < 0x7F:
            keys.append(Key(chr(first).lower()))
            typed.append(keys[-1])
        else:
            self.dropped += 1  # another control character, or not of this alphabet
        return 1


def _of_sequence(parameters: str, final: bytes) -> Key | None:
    """Return what a sequence `ESC [ parameters final` says; None where it is no key that is known."""
    if parameters == "" and final in (b"I", b"O"):
        return Key(FOCUS_IN if final == b"I" else FOCUS_OUT)
    if final == b"u" and parameters.startswith("?"):
        return Key(TELLS_RELEASES)
    if final in (b"n", b"c"):
        return Key(THERE)
    code, _, rest = parameters.partition(";")
    modifiers, _, change = rest.partition(";")[0].partition(":")
    how = _CHANGES.get(change or "1")
    held = int(modifiers) - 1 if modifiers.isdigit() else 0
    if how is None:
        return None
    if final in _ARROWS:
        return Key(_ARROWS[final], how)
    number = code.partition(":")[0]
    if final != b"u" or not number.isdigit():
        return None
    return _of_code(int(number), held, how)


def _of_code(code: int, modifiers: int, change: Change) -> Key | None:
    """Return a key by its number in kitty's protocol."""
    if modifiers & _CONTROL and change != "up":
        return Key(INTERRUPT) if code == ord("c") else None
    if code in _NAMED:
        return Key(_NAMED[code], change)
    return Key(chr(code).lower(), change) if 0x20 < code < 0x7F else None
