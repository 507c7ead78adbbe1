"""What the controls do now, in words, drawn from the map in force."""

from collections.abc import Sequence

from handrail.collect.devices.control_map import ACTIONS, ControlMap, Moves

_AXES = {
    "base.vx": ("base forward", "backward"),
    "base.vy": ("base left", "right"),
    "base.wz": ("base turns left", "right"),
    "ee.vx": ("hand forward", "backward"),
    "ee.vy": ("hand left", "right"),
    "ee.vz": ("hand up", "down"),
    "ee.wx": ("hand rolls right", "left"),
    "ee.wy": ("hand tips down", "up"),
    "ee.wz": ("hand turns left", "right"),
}
_CONTROLS = {
    "left_x": "left stick ↔",
    "left_y": "left stick ↕",
    "right_x": "right stick ↔",
    "right_y": "right stick ↕",
    "left_stick": "press left stick",
    "right_stick": "press right stick",
    **{name: f"{sign}" for name, sign in (("left", "←"), ("right", "→"), ("up", "↑"), ("down", "↓"))},
}


def control_name(control: str) -> str:
    """Return what a control is called."""
    return _CONTROLS.get(control, control.replace("_", " "))


def moves_help(moves: Moves) -> list[tuple[str, str]]:
    """Return what moves what: controls, and in words what they do."""
    lines = []
    for axis in dict.fromkeys(axis for axis, _ in moves.values()):
        of_axis = [(control, sign) for control, (name, sign) in moves.items() if name == axis]
        forward, backward = _AXES.get(axis, (f"{_joint(axis)} +", "−"))
        ordered = sorted(of_axis, key=lambda each: -each[1])
        lines.append((" / ".join(control_name(name) for name, _ in ordered), f"{forward} / {backward}"))
    return lines


def actions_help(controls: ControlMap) -> list[tuple[str, str]]:
    """Return what asks for what."""
    by_action: dict[str, list[str]] = {}
    for control, action in controls.actions.items():
        by_action.setdefault(action, []).append(control_name(control))
    return [(", ".join(by_action[name]), words) for name, words in ACTIONS.items() if name in by_action]


def control_of(controls: Sequence[ControlMap], *actions: str) -> str:
    """Return the control that asks for one of some actions; nothing where none does."""
    for table in controls:
        for control, action in table.actions.items():
            if action in actions:
                return control_name(control)
    return ""


def _joint(axis: str) -> str:
    return axis.removeprefix("joint.").removesuffix("_joint").replace("_", " ")
