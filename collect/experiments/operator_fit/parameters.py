"""What is fitted: between which bounds, and when an episode can tell it at all."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

from handrail.collect.experiments.operator_fit.episodes import Steered
from handrail.collect.operators.human.human import HumanSettings


@dataclass(frozen=True)
class Parameter:
    """One number of `HumanSettings`.

    Attributes:
        name: as there.
        unit: of it.
        low: smallest that is tried.
        high: largest that is tried.
        pressed: whether on/off keys can tell it; they do not say how far an input is pushed.
    """

    name: str
    unit: str
    low: float
    high: float
    pressed: bool = False


PARAMETERS = (
    Parameter("delay", "s", 0.05, 0.8, pressed=True),
    Parameter("refractory", "s", 0.1, 1.2, pressed=True),
    Parameter("threshold", "", 0.005, 0.2),
    Parameter("noise", "", 0.01, 0.5),
    Parameter("drift", "", 0.003, 0.15),
    Parameter("correlation", "s", 0.1, 2.0),
    Parameter("switch_time", "s", 0.05, 1.5, pressed=True),
    Parameter("movement", "s", 0.05, 0.5),
    Parameter("misjudgement", "", 0.01, 0.3),
    Parameter("briskness", "", 0.3, 3.0, pressed=True),
)
_KEYS = "keys are on or off: they do not tell how far an input is meant to be pushed"
_ELSEWHERE = {
    "persons": "it is between persons: fit each of several, and compare them",
    "moods": "it is between episodes of one person, and is kept as it is",
}


def untold(episodes: Sequence[Steered]) -> dict[str, str]:
    """Return which numbers of the settings episodes cannot tell, whatever their values, and why."""
    known = {each.name: each for each in PARAMETERS}
    reasons = {entry.name: "" for entry in fields(HumanSettings)} | _ELSEWHERE
    if not any((each.owned[1:] != each.owned[:-1]).any() for each in episodes):
        reasons["switch_time"] = "the operator never changed to other channels"
    if any(each.keys for each in episodes):
        reasons |= {name: _KEYS for name, each in known.items() if not (each.pressed or reasons[name])}
    return {name: reason for name, reason in reasons.items() if reason}
