"""Which part of the robot an entry of the action moves, by its name."""

from collections.abc import Sequence

ALL = "all"
BASE, TURN, HAND, ARM, GRIPPER, OTHER = "base xy", "base turn", "hand", "arm", "gripper", "other"
_PLACE, _TURN = ("x", "y", "vx", "vy"), ("theta", "wz", "yaw")
_BEFORE, _AFTER = ("joint.", "base.", "v_"), (".vel", ".pos", "_vel")


def parts(names: Sequence[str]) -> dict[str, list[int]]:
    """Return the entries that move each part: all of them first, then each part that is there.

    `joint.x`, `base.vx`, `v_x` and `x.vel` are a base's where something turns it too; `ee.` begins the hand's
    channels; other joints are the arm's.
    """
    mobile = any(_core(name) in _TURN for name in names)
    found: dict[str, list[int]] = {ALL: list(range(len(names)))}
    of_each = [_part(name, mobile) for name in names]
    for part in (BASE, TURN, HAND, ARM, GRIPPER, OTHER):
        places = [place for place, name in enumerate(of_each) if name == part]
        found |= {part: places} if places else {}
    return found


def _part(name: str, mobile: bool) -> str:
    if "gripper" in name.lower():
        return GRIPPER
    if name.startswith("ee."):
        return HAND
    if mobile and _core(name) in (*_PLACE, *_TURN):
        return BASE if _core(name) in _PLACE else TURN
    return ARM if _core(name) != name.lower() else OTHER


def _core(name: str) -> str:
    core = name.lower()
    for before in _BEFORE:
        core = core.removeprefix(before)
    for after in _AFTER:
        core = core.removesuffix(after)
    return core
