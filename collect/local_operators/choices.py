"""What an action asks of a person: from where they stand to the choice that comes next."""

from handrail.collect.operators.person.inputs import ASKS, Ask
from handrail.collect.operators.person.person import Person, Phase

FRAMES = ("base", "tool", "world")  # of the hand; there is no page that looks from somewhere
_STEP, _LEAST = 0.2, 0.2  # of the speed


def choice_of(action: str, person: Person) -> Ask | None:
    """Return what an action asks for now; None where it asks nothing of the person."""
    setting = person.setting
    if action in ("start", "start_or_pause"):
        return _started(action, person.phase)
    if action in ("mode", "mode_back"):
        names = list(person.modes)
        at = names.index(setting.mode.name) if setting.mode.name in names else 0
        return Ask("mode", names[(at + (1 if action == "mode" else -1)) % len(names)])
    if action in ("faster", "slower", "speed"):
        return Ask("speed", _speed(action, setting.speed))
    if action == "frame":
        at = FRAMES.index(setting.frame) if setting.frame in FRAMES else -1
        return Ask("frame", FRAMES[(at + 1) % len(FRAMES)])
    if action == "focus":
        return Ask("focus", "hand" if setting.focus == "base" else "base")
    if action == "practice":
        return Ask("practice", not person.practises)
    return Ask(action) if action in ASKS else None


def _started(action: str, phase: Phase) -> Ask:
    """Return what start asks for: after the e-stop, first that it is released."""
    if phase is Phase.STOPPED:
        return Ask("stop", False)
    if action == "start_or_pause" and phase in (Phase.DRIVING, Phase.LOST):
        return Ask("pause")
    return Ask("start")


def _speed(action: str, now: float) -> float:
    if action == "speed":
        return _LEAST if now > 1.0 - _STEP / 2 else round(now + _STEP, 1)
    return round(min(1.0, max(_LEAST, now + (_STEP if action == "faster" else -_STEP))), 1)
