"""Messages of a page, checked where they come in: a few kinds, a few numbers and words each.

```
drive    seq, echo, on, device, grip, axes (one deflection a channel), view, targets (of the arm's joints)
                                 latest wins, many a second
ask      what, value            each counts, once
         stop, true, press      STOP; again, with the same number, until it was heard and a frame says so
answer   card, item, value      to a question on a card; comes again until the card says that it is kept
```
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from msgspec import DecodeError, Meta
from msgspec.json import decode

from handrail.collect.operators.person.inputs import ASKS, MOST, STILLS, Ask, Input
from handrail.controllers.errors import HandrailError, shown
from handrail.controllers.typed import Fraction, check, check_names, decoded

LARGEST = 4096  # message [bytes]
LEASE = ("take", "give")  # asks that concern the pages alone
_ASKS = {**ASKS, **dict.fromkeys(LEASE, bool)}
_VALUES: Mapping[type, Any] = {
    bool: bool,
    str: Annotated[str, Meta(max_length=100)],
    float: Fraction,
    list: Annotated[tuple[Annotated[int, Meta(ge=0, lt=2**53)], ...], Meta(max_length=MOST)],
}
_Label = Annotated[str, Meta(max_length=200)]


@dataclass(frozen=True)
class CardAnswer:
    """An answer to a question on a card; whoever asks checks whether it fits the question."""

    card: _Label
    item: _Label
    value: (
        str
        | bool
        | Annotated[int, Meta(gt=-(2**53), lt=2**53)]
        | Annotated[float, Meta(ge=-1e9, le=1e9)]
        | None  # "prefer not to answer"
    )


@dataclass(frozen=True)
class Stop:
    """The e-stop."""

    press: int = 0  # a repeated message says the same number; 0 where the page counts none


@dataclass(frozen=True, kw_only=True)
class Drive(Input):
    """Where the inputs of a page are, many times a second."""

    device: Literal["keyboard", "gamepad", "touch", "sliders", "xr"]  # pyright: ignore[reportGeneralTypeIssues]
    seq: Annotated[int, Meta(ge=0, lt=2**53)]  # counts up
    echo: Annotated[float, Meta(ge=0, le=1e12)]  # the server's time in the newest frame on the page [s]


Message = Drive | Ask | CardAnswer | Stop


def stills(said: Message) -> bool:
    """Whether a message takes motion away: all is let go, or the robot is left at rest."""
    if isinstance(said, Drive):
        return not said.on or said.is_let_go
    return isinstance(said, Stop) or (isinstance(said, Ask) and (said.what in STILLS or said.what == "give"))


def parse(text: str | bytes) -> Message:
    """Return a page's message."""
    if len(text) > LARGEST:
        raise HandrailError(f"message: expected at most {LARGEST} bytes, got {len(text)}")
    try:
        return _typed(decode(text))
    except (DecodeError, ValueError, RecursionError) as error:  # also half of a surrogate pair
        raise HandrailError("message: expected JSON") from error


def _typed(said: Any) -> Message:
    kind = said.pop("kind", None) if isinstance(said, dict) else None
    if kind == "drive":
        return decoded(said, Drive, "message")
    if kind == "answer":
        return decoded(said, CardAnswer, "message")
    if kind != "ask":
        raise HandrailError(f"message: expected an object of kind drive, ask or answer, got {shown(said)}")
    what, value = said.get("what"), said.get("value")
    if what == "stop" and value is True:
        press = said.get("press")
        return Stop(press if type(press) is int else 0)  # whatever else it says, it is a stop
    check_names(said, {"what": "", "value": ""}, "message")
    if not isinstance(what, str) or what not in _ASKS:
        raise HandrailError(f"ask: expected one of {', '.join(_ASKS)}, got {shown(what)}")
    return Ask(what, check(value, _VALUES[_ASKS[what]], what))
