"""What the names of a column's entries say: which are a point in space, which mean the same."""

from collections.abc import Sequence

Pair = tuple[int, int]  # the entry of the action and the entry of the state that it commands

_POINTS = ("tool", "ee", "eef", "end_effector", "gripper_pose", "hand")


def point_entries(names: Sequence[str]) -> list[int]:
    """Return the entries that are the tool's position, in order x, y, z; none where no name says so."""
    lower = [name.lower() for name in names]
    plain = [name.removesuffix(".pos") for name in lower]
    for point in _POINTS:
        for joint in (".", "_"):
            wanted = [f"{point}{joint}{axis}" for axis in "xyz"]
            if all(name in plain for name in wanted):
                return [plain.index(name) for name in wanted]
    for wanted in (list("xyz"), list("xy")):
        if all(name in lower for name in wanted):
            return [lower.index(name) for name in wanted]
    return []


def position_entries(names: Sequence[str]) -> list[int]:
    """Return the entries that are joint positions (`elbow.pos`), the gripper's included."""
    return [index for index, name in enumerate(names) if name.endswith(".pos")]


def gripper_entry(names: Sequence[str]) -> int | None:
    """Return the entry that opens and closes the gripper."""
    found = [index for index, name in enumerate(names) if "gripper" in name.lower()]
    return found[0] if len(found) == 1 else None


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
    point = lower in ("x", "y", "z") or lower.startswith(tuple(f"{each}." for each in _POINTS))
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
