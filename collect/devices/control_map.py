"""What the controls of a device mean: one table, from a file, that a person may change.

A section says which axis a control moves while that part is steered: `[hand]`, `[turn]` (of the hand),
`[base]`, `[both]` (hand and base at once) and `[joints]`; `[actions]` says what a press asks for. Parts that
need the same controls are banks: the action `focus` goes from one to the next.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from handrail.collect.devices.device import DeviceInput
from handrail.controllers.errors import HandrailError, shown
from handrail.controllers.interface.channels import BASE, TOOL
from handrail.controllers.strict_toml import read_toml
from handrail.controllers.typed import check, check_names

SECTIONS: Mapping[str, tuple[str, ...]] = {
    "hand": TOOL,
    "turn": TOOL,
    "base": BASE,
    "both": (*BASE, *TOOL),
    "joints": tuple(f"joint.{number}" for number in range(1, 8)),
}
ACTIONS: Mapping[str, str] = {
    "hold": "hold to move",
    "clutch": "hold: the arm follows the leader",
    "start": "start, go on",
    "start_or_pause": "start, pause",
    "pause": "pause",
    "stop": "emergency stop",
    "grip": "close or open the gripper",
    "focus": "hand or base; the next joints",
    "mode": "next mode",
    "mode_back": "mode before",
    "frame": "frame of the hand: base, tool, world",
    "faster": "faster",
    "slower": "slower",
    "speed": "next speed",
    "undo": "back to the last pause",
    "success": "end it: success",
    "failure": "end it: failure",
    "restart": "throw away, begin it again",
    "discard": "throw away, go on with another",
    "quit": "end the recording",
    "practice": "practice: not recorded",
    "help": "show or hide this help",
}
HELD = ("hold", "clutch")  # actions that last as long as the control is down
_FOLDER = Path(__file__).parent / "maps"

Moves = Mapping[str, tuple[str, int]]  # axis and sign of each control


@dataclass(frozen=True)
class ControlMap:
    """The table of a device."""

    moves: Mapping[str, Moves]
    """By section and control, the axis and its sign."""
    actions: Mapping[str, str]
    """By control."""

    def meant(self, said: DeviceInput, presses: Iterable[str], moves: Moves) -> DeviceInput:
        """Return an input in the words of the map: channels instead of axes, actions instead of presses.

        Args:
            said: by the device.
            presses: all since the last time.
            moves: in force now.
        """
        actions = self.actions
        holds = {actions[name] for name in said.deflections if actions.get(name) in HELD}
        if "hold" not in actions.values():
            holds.add("hold")
        axes: dict[str, float] = {}
        if "hold" in holds and said.attended:
            for control, (axis, sign) in moves.items():
                axes[axis] = axes.get(axis, 0.0) + sign * said.deflections.get(control, 0.0)
        asked = (actions[name] for name in presses if name in actions)
        return replace(
            said,
            deflections={axis: value for axis, value in axes.items() if value},
            presses=tuple(action for action in asked if action not in HELD),
            holds=frozenset(holds) if said.attended else frozenset(holds - {"clutch"}),
        )

    def only(self, *sections: str) -> "ControlMap":
        """Return it without the moves of other sections."""
        return ControlMap({name: self.moves.get(name, {}) for name in sections}, self.actions)

    def banks(self, hand: bool, base: bool, arm: tuple[str, ...] = ()) -> list[Moves]:
        """Return the moves that are in force together, one bank or several.

        Args:
            hand: whether the hand is steered.
            base: whether the base is.
            arm: channels of the arm's joints that are steered; the section's are counted from the first.
        """
        of = self.moves.get
        both = "both" if base and of("both") else "hand"
        parts = [of(both, {}), of("turn", {})] if hand else []
        parts += self._of_joints(arm)
        parts += [of("base", {})] if base else []
        banks: list[dict[str, tuple[str, int]]] = []
        for part in filter(None, parts):
            fitting = next((bank for bank in banks if not bank.keys() & part.keys()), None)
            if fitting is None:
                banks.append(dict(part))
            else:
                fitting.update(part)
        return list(banks) or [{}]

    def _of_joints(self, arm: tuple[str, ...]) -> list[Moves]:
        """Return the moves of the arm's joints, as many at a time as the section has."""
        section = self.moves.get("joints", {})
        at_once = len({axis for axis, _ in section.values()})
        chunks = [arm[first : first + at_once] for first in range(0, len(arm), at_once)] if at_once else []
        named = [dict(zip(SECTIONS["joints"], chunk, strict=False)) for chunk in chunks]
        return [
            {control: (names[axis], sign) for control, (axis, sign) in section.items() if axis in names}
            for names in named
        ]


def load_map(device: str, controls: Iterable[str], changes: str = "") -> ControlMap:
    """Return the table of a device, with a person's changes.

    Args:
        device: its name.
        controls: that it has.
        changes: a .toml file of the same form, with the sections and controls that differ, or an empty path.
    """
    table = read_toml(_FOLDER / f"{device}.toml", "controls")
    if changes:
        path = Path(changes).expanduser()
        changed = read_toml(path, "--teleop.map")
        _check(changed, dict.fromkeys(sorted(controls)), f"--teleop.map {path}")
        table = {name: table.get(name, {}) | changed.get(name, {}) for name in {**table, **changed}}
    actions = {control: action for control, action in table.pop("actions").items() if action}
    moves = {
        name: {control: _axis(value) for control, value in section.items() if value}
        for name, section in table.items()
    }
    return ControlMap(moves, actions)


def _axis(value: str) -> tuple[str, int]:
    return value.removeprefix("-"), -1 if value.startswith("-") else 1


def _check(table: dict[str, Any], controls: Mapping[str, Any], where: str) -> None:
    """Check a person's table; an empty text takes a meaning away."""
    meanings = {name: (*axes, *(f"-{axis}" for axis in axes)) for name, axes in SECTIONS.items()}
    meanings["actions"] = tuple(ACTIONS)
    for name, section in table.items():
        if name not in meanings or not isinstance(section, dict):
            expected = "], [".join(meanings)
            raise HandrailError(f"{where}: section {shown(name)}: expected some of [{expected}]")
        check_names(section, controls, f"{where}: [{name}]")
        for control, value in section.items():
            check(value, Literal[*meanings[name], ""], f"{where}: [{name}] {control}")


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
    **{"left": "←", "right": "→", "up": "↑", "down": "↓"},
}


def control_name(control: str) -> str:
    """Return what a control is called."""
    return _CONTROLS.get(control, control.replace("_", " "))


def moves_help(moves: Moves) -> list[tuple[str, str]]:
    """Return what moves what: controls, and in words what they do."""
    lines = []
    for axis in dict.fromkeys(axis for axis, _ in moves.values()):
        of_axis = [(control, sign) for control, (name, sign) in moves.items() if name == axis]
        joint = axis.removeprefix("joint.").removesuffix("_joint").replace("_", " ")
        forward, backward = _AXES.get(axis, (f"{joint} +", "−"))
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
    of_all = (each for table in controls for each in table.actions.items())
    return next((control_name(control) for control, action in of_all if action in actions), "")
