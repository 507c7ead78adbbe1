"""What a page may say, checked where it comes in: a few kinds of messages, a few numbers and words each.

```
drive    seq, echo, on, device, grip, axes (one deflection a channel), view, targets (of the arm's joints)
                                 latest wins, many a second
ask      what, value            each counts, once
         stop, true, press      STOP; comes again, with the same number, until a frame says that it is so
answer   card, item, value      to a question on a card; comes again until the card says that it is kept
```
"""

import json
import math
from dataclasses import dataclass
from typing import Any

from handrail.collect.operators.person.inputs import ASKS, STILLS, Ask, Input
from handrail.controllers.errors import HandrailError, shown

LARGEST = 4096  # message [bytes]
DEVICES = ("keyboard", "gamepad", "touch", "sliders", "xr")
_MOST_AXES = 64
_LONGEST_NAME = 200  # of a card or a question
_MOST_SEQUENCE = 2**53

LEASE = ("take", "give")  # asks that concern the pages alone
_KINDS = {**ASKS, **dict.fromkeys(LEASE, bool)}
_LARGEST_ANGLE = 20.0  # [rad]


@dataclass(frozen=True)
class CardAnswer:
    """What a person says to a question on a card.

    Attributes:
        card: its id.
        item: the question.
        value: None for "prefer not to answer"; whether it fits the question is checked by who asks.
    """

    card: str
    item: str
    value: str | float | int | bool | None


@dataclass(frozen=True)
class Stop:
    """The e-stop.

    Attributes:
        press: which one: a repeated message says the same number; 0 where the page counts none.
    """

    press: int = 0


@dataclass(frozen=True)
class Drive:
    """What a page says many times a second.

    Attributes:
        sequence: counts up.
        echo: the server's time in the newest frame that the page has drawn [s].
        inputs: where they are.
    """

    sequence: int
    echo: float
    inputs: Input


Said = Drive | Ask | CardAnswer | Stop


def stills(said: Said) -> bool:
    """Whether a message takes motion away: all is let go, or the robot is left at rest."""
    if isinstance(said, Drive):
        return not said.inputs.on or said.inputs.is_let_go
    return isinstance(said, Stop) or (isinstance(said, Ask) and (said.what in STILLS or said.what == "give"))


def parse(text: str | bytes) -> Said:
    """Return what a page said."""
    if len(text) > LARGEST:
        raise HandrailError(f"message: expected at most {LARGEST} bytes, got {len(text)}")
    try:
        said = json.loads(text, parse_constant=_no_number)
    except (ValueError, RecursionError) as error:
        raise HandrailError("message: expected JSON") from error
    if not isinstance(said, dict):
        raise HandrailError(f"message: expected an object, got {shown(said)}")
    kind = said.pop("kind", None)
    if kind == "drive":
        return _drive(said)
    if kind == "ask":
        return _ask(said)
    if kind == "answer":
        return _answer(said)
    raise HandrailError(f"message: expected kind drive, ask or answer, got {shown(kind)}")


def _drive(said: dict[str, Any]) -> Drive:
    _check_keys(said, ("seq", "echo", "on", "device", "grip", "axes", "view", "targets"))
    sequence = said["seq"]
    if type(sequence) is not int or not 0 <= sequence < _MOST_SEQUENCE:
        raise HandrailError(f"seq: expected a whole number >= 0, got {shown(sequence)}")
    if said["device"] not in DEVICES:
        raise HandrailError(f"device: expected one of {', '.join(DEVICES)}, got {shown(said['device'])}")
    inputs = Input(
        _flag("on", said["on"]),
        said["device"],
        _flag("grip", said["grip"]),
        _numbers("axes", said["axes"], 1.0),
        _number("view", said["view"], -10.0, 10.0),
        _numbers("targets", said["targets"], _LARGEST_ANGLE),
    )
    return Drive(sequence, _number("echo", said["echo"], 0.0, 1e12), inputs)


def _answer(said: dict[str, Any]) -> CardAnswer:
    _check_keys(said, ("card", "item", "value"))
    for name in ("card", "item"):
        if not isinstance(said[name], str) or len(said[name]) > _LONGEST_NAME:
            raise HandrailError(f"{name}: expected a name, got {shown(said[name])}")
    value = said["value"]
    if not isinstance(value, str | bool | None):
        value = (
            value
            if type(value) is int and abs(value) < _MOST_SEQUENCE
            else _number("value", value, -1e9, 1e9)
        )
    return CardAnswer(said["card"], said["item"], value)


def _numbers(name: str, value: object, largest: float) -> tuple[float, ...]:
    if not isinstance(value, list) or len(value) > _MOST_AXES:
        raise HandrailError(f"{name}: expected a list of at most {_MOST_AXES} numbers, got {shown(value)}")
    return tuple(_number(name, each, -largest, largest) for each in value)


def _ask(said: dict[str, Any]) -> Ask | Stop:
    if said.get("what") == "stop" and said.get("value") is True:
        press = said.get("press")
        return Stop(press if type(press) is int else 0)  # whatever else it says, it is a stop
    _check_keys(said, ("what", "value"))
    what, value = said["what"], said["value"]
    if not isinstance(what, str) or what not in _KINDS:
        raise HandrailError(f"ask: expected one of {', '.join(_KINDS)}, got {shown(what)}")
    wanted = _KINDS[what]
    if wanted is float:
        return Ask(what, _number(what, value, 0.0, 1.0))
    if wanted is list:
        return Ask(what, _whole_numbers(what, value))
    if type(value) is not wanted or (wanted is str and len(value) > 100):
        raise HandrailError(f"{what}: expected {wanted.__name__}, got {shown(value)}")
    return Ask(what, value)


def _whole_numbers(what: str, value: object) -> tuple[int, ...]:
    if not isinstance(value, list) or len(value) > _MOST_AXES or any(type(each) is not int for each in value):
        raise HandrailError(f"{what}: expected a list of whole numbers, got {shown(value)}")
    return tuple(value)


def _check_keys(said: dict[str, Any], keys: tuple[str, ...]) -> None:
    if set(said) != set(keys):
        raise HandrailError(f"message: expected {', '.join(keys)}, got {shown(', '.join(map(str, said)))}")


def _number(name: str, value: object, low: float, high: float) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise HandrailError(f"{name}: expected a number, got {shown(value)}")
    if not low <= value <= high:
        raise HandrailError(f"{name}: expected {low} to {high}, got {shown(value)}")
    return float(value)


def _flag(name: str, value: object) -> bool:
    if not isinstance(value, bool):
        raise HandrailError(f"{name}: expected true or false, got {shown(value)}")
    return value


def _no_number(word: str) -> float:
    raise ValueError(word)
