"""The meaning of the names of a column's entries: which are a point in space, which mean the same.

With several hands the names of what is a hand's begin with its own: `left.tool.x`, `left_gripper.pos`.
"""

import re
from collections.abc import Sequence

Pair = tuple[int, int]  # the entry of the action and the entry of the state that it commands

_POINTS = ("tool", "ee", "eef", "end_effector", "gripper_pose", "hand")
_POINT = re.compile(rf"(.*[._])?({'|'.join(_POINTS)})\.")
_HAND = re.compile(rf"(\w+)[._](?:(?:{'|'.join(_POINTS)})[._]x|gripper(?:\.\w+)?)")


def hand_names(names: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the hands that a column's entries tell apart; () of one hand, which has none."""
    found = (_HAND.fullmatch(name.lower().removesuffix(".pos")) for name in names)
    hands = dict.fromkeys(each[1] for each in found if each)
    return tuple(hands) if len(hands) > 1 else ()


def point_entries(names: Sequence[str], hand: str = "") -> list[int]:
    """Return the entries that are the tool's position, in order x, y, z; none where no name says so.

    Of several hands one after the other; `hand` is the one that is meant.
    """
    if hands := () if hand else hand_names(names):
        return [entry for each in hands for entry in point_entries(names, each)]
    lower = [name.lower() for name in names]
    plain = [name.removesuffix(".pos") for name in lower]
    for point in (prefix + point for point in _POINTS for prefix in _prefixes(hand)):
        for joint in (".", "_"):
            wanted = [f"{point}{joint}{axis}" for axis in "xyz"]
            if all(name in plain for name in wanted):
                return [plain.index(name) for name in wanted]
    if hand:
        return []
    for wanted in (list("xyz"), list("xy")):
        if all(name in lower for name in wanted):
            return [lower.index(name) for name in wanted]
    return []


def position_entries(names: Sequence[str], hand: str = "") -> list[int]:
    """Return the entries that are joint positions (`elbow.pos`), the gripper's included; of a hand's arm.

    `goal.x.pos` and `tool.qw.pos`, as LeRobot has them from our robot, are none where there are others.
    """
    own, hands = _prefixes(hand), ("", hand, *hand_names(names))
    found = [i for i, name in enumerate(names) if name.endswith(".pos") and name.lower().startswith(own)]
    before = {i: names[i].lower().removesuffix(".pos").rpartition(".")[0] for i in found}
    return [i for i in found if before[i] in hands] or found


def gripper_entries(names: Sequence[str], hand: str = "") -> list[int]:
    """Return the entries that open and close a gripper, one a hand; none where names do not tell which."""
    if hands := () if hand else hand_names(names):
        return [entry for each in hands for entry in gripper_entries(names, each)]
    lower, own = [name.lower() for name in names], _prefixes(hand)
    found = [i for i, name in enumerate(lower) if "gripper" in name and name.startswith(own)]
    return found if len(found) == 1 else []


def _prefixes(hand: str) -> tuple[str, ...]:
    """Return how names of what is a hand's begin."""
    return (f"{hand}.", f"{hand}_") if hand else ("",)


def is_velocity(name: str) -> bool:
    """Return whether an entry is a velocity by its name (`v_x`, `elbow.vel`)."""
    return name.startswith("v_") or name.endswith((".vel", "_vel", ".velocity"))


def quantity(name: str) -> str:
    """Return what an entry is by its name: velocity, position, gripper, or "" where it does not say."""
    lower = name.lower()
    if "gripper" in lower:
        return "gripper"
    if is_velocity(lower):
        return "velocity"
    point = lower in ("x", "y", "z") or _POINT.match(lower)
    return "position" if point or lower.endswith((".pos", "_pos", ".position")) else ""


def same_thing(action: Sequence[str], state: Sequence[str]) -> list[Pair]:
    """Return which entry of the state measures what an entry of the action commands, in the same unit.

    An entry of the same name, or `elbow.vel` for `v_elbow`.
    """
    places = {name: index for index, name in enumerate(state)}
    pairs = []
    for index, name in enumerate(action):
        counterpart = name if name in places else f"{name.removeprefix('v_')}.vel"
        if counterpart in places and (counterpart == name or name.startswith("v_")):
            pairs.append((index, places[counterpart]))
    return pairs
