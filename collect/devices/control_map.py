"""The meaning of a device's controls: one table, from a file, that a person may change.

A section says which axis a control moves while that part is steered: `[hand]` (one of several, or both as a
pair), `[turn]` (of the hand), `[apart]` (of a pair), `[hands]` and `[hands_turn]` (two at once), `[base]`,
`[both]` (hand and base at once) and `[joints]`; `[actions]` says what a press asks for, `[hand_actions]` what
it asks for instead on a robot with several hands. A control that moves something asks for nothing but the
stop. Parts that need the same controls are banks: the action `focus` goes from one to the next.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

from handrail.collect.devices.device import DeviceInput
from handrail.controllers.interface.channels import BASE, TOOL
from handrail.controllers.strict_toml import read_toml
from handrail.controllers.typed import check, check_names

FIRST, SECOND = (tuple(axis.replace("ee", name) for axis in TOOL) for name in ("one", "two"))
SECTIONS: Mapping[str, tuple[str, ...]] = {
    "hand": TOOL,
    "turn": TOOL,
    "apart": ("apart.v",),
    "hands": (*FIRST, *SECOND, *TOOL),
    "hands_turn": (*FIRST, *SECOND, *TOOL),
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
    "stop": "STOP",
    "grip": "close or open the gripper",
    "grip_left": "close or open the first gripper",
    "grip_right": "close or open the second gripper",
    "hand": "the other hand",
    "focus": "hand or base; the next joints",
    "mode": "next mode",
    "mode_back": "mode before",
    "frame": "frame of the hand: base, tool, world",
    "faster": "faster",
    "slower": "slower",
    "speed": "next speed",
    "undo": "back to where you went on last",
    "success": "end it: success",
    "failure": "end it: failure",
    "restart": "throw away, begin it again",
    "discard": "throw away, go on with another",
    "quit": "end the recording",
    "practice": "practice: not recorded",
    "help": "show or hide this help",
}
HOLD, CLUTCH = "hold", "clutch"  # actions that last as long as the control is down
STOP = "stop"
_FOLDER = Path(__file__).parent / "maps"

Moves = Mapping[str, tuple[str, int]]  # axis and sign of each control


class Steered(NamedTuple):
    """The parts that are steered now."""

    hand: bool
    base: bool
    arm: tuple[str, ...] = ()
    """Channels of the arm's joints; the section's are counted from the first."""
    hands: bool = False  # two at once
    apart: bool = False


@dataclass(frozen=True)
class ControlMap:
    """The table of a device."""

    moves: Mapping[str, Moves]
    """By section and control, the axis and its sign."""
    actions: Mapping[str, str]
    """By control."""

    @property
    def stops(self) -> frozenset[str]:
        """Controls of the emergency stop."""
        return frozenset(name for name, action in self.actions.items() if action == STOP)

    def meant(self, said: DeviceInput, presses: Iterable[str], moves: Moves) -> DeviceInput:
        """Return an input in the words of the map: channels instead of axes, actions instead of presses.

        Where no control asks for `hold`, it always holds.

        Args:
            said: by the device.
            presses: all since the last time.
            moves: in force now.
        """
        actions = self.actions
        down = {actions.get(name) for name in said.deflections}
        meant = {name: 1.0 for name in (HOLD, CLUTCH) if name in down}
        if HOLD not in actions.values():
            meant[HOLD] = 1.0
        for control, (axis, sign) in moves.items() if HOLD in meant else ():
            meant[axis] = meant.get(axis, 0.0) + sign * said.deflections.get(control, 0.0)
        free = [name for name in presses if name in actions and (name not in moves or name in self.stops)]
        asked = tuple(actions[name] for name in free)
        return replace(said, deflections=meant, presses=asked)

    def only(self, *sections: str) -> "ControlMap":
        """Return it without the moves of other sections."""
        return ControlMap({name: self.moves.get(name, {}) for name in sections}, self.actions)

    def banks(self, steered: Steered) -> list[Moves]:
        """Return the moves that are in force together, one bank or several."""
        of, arm = self.moves.get, steered.arm
        both = "both" if steered.base and of("both") else "hand"
        parts = [of(both, {}), of("turn", {})] if steered.hand else []
        parts = [of("hands", {}), of("hands_turn", {})] if steered.hands else parts
        parts += [of("apart", {})] if steered.apart else []
        joints = of("joints", {})
        at_once = len({axis for axis, _ in joints.values()}) or 1
        for first in range(0, len(arm), at_once):
            names = dict(zip(SECTIONS["joints"], arm[first : first + at_once], strict=False))
            parts.append(
                {name: (names[axis], sign) for name, (axis, sign) in joints.items() if axis in names}
            )
        parts += [of("base", {})] if steered.base else []
        banks: list[dict[str, tuple[str, int]]] = [{}]
        for part in parts:
            fitting = next((bank for bank in banks if not bank.keys() & part.keys()), None)
            if fitting is None:
                banks.append(dict(part))
            else:
                fitting.update(part)
        return list(banks)


def load_map(device: str, controls: Iterable[str], changes: str = "", hands: int = 1) -> ControlMap:
    """Return the table of a device, with a person's changes.

    Args:
        device: its name.
        controls: that it has.
        changes: a .toml file of the same form, with the sections and controls that differ, or an empty path.
        hands: how many the robot has.
    """
    table = read_toml(_FOLDER / f"{device}.toml", "controls")
    if changes:
        path = Path(changes).expanduser()
        changed = read_toml(path, "--teleop.map")
        _check(changed, dict.fromkeys(sorted(controls)), f"--teleop.map {path}")
        table = {name: table.get(name, {}) | changed.get(name, {}) for name in {**table, **changed}}
    given = {name: {at: value for at, value in table[name].items() if value} for name in table}
    actions, of_hands = given.pop("actions"), given.pop("hand_actions")
    actions |= of_hands if hands > 1 else {}
    return ControlMap({name: _moves(section) for name, section in given.items()}, actions)


def _moves(section: Mapping[str, str]) -> Moves:
    return {at: (axis.removeprefix("-"), -1 if axis[0] == "-" else 1) for at, axis in section.items()}


def _check(table: dict[str, Any], controls: Mapping[str, Any], where: str) -> None:
    """Check a person's table; an empty text takes a meaning away."""
    meanings = {name: (*axes, *(f"-{axis}" for axis in axes)) for name, axes in SECTIONS.items()}
    meanings["actions"] = meanings["hand_actions"] = tuple(ACTIONS)
    check_names(table, meanings, where)
    for name, section in table.items():
        check_names(check(section, dict[str, Any], f"{where}: [{name}]"), controls, f"{where}: [{name}]")
        for control, value in section.items():
            check(value, Literal[*meanings[name], ""], f"{where}: [{name}] {control}")


_WAYS = {
    "vx": ("forward", "backward"),
    "vy": ("left", "right"),
    "vz": ("up", "down"),
    "wx": ("rolls right", "left"),
    "wy": ("tips down", "up"),
    "wz": ("turns left", "right"),
    "v": ("apart", "together"),
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


def moves_help(moves: Moves, parts: Mapping[str, str]) -> list[tuple[str, str]]:
    """Return what moves what: controls, and in words what they do.

    Args:
        moves: in force now.
        parts: names of what parts of axes stand for.
    """
    lines = []
    for axis in dict.fromkeys(axis for axis, _ in moves.values()):
        of_axis = {control: sign for control, (name, sign) in moves.items() if name == axis}
        part, _, way = axis.partition(".")
        joint = way.removesuffix("_joint").replace("_", " ")
        there, back = _WAYS.get(way, (f"{joint} +", "−"))
        name = {"ee": "hand", "pair": "both hands", "apart": "hands"}.get(parts.get(part, part))
        said = there if part == "joint" else f"{name or parts.get(part, part)} {there}"
        controls = sorted(of_axis, key=lambda control: -of_axis[control])
        lines.append((" / ".join(map(control_name, controls)), f"{said} / {back}"))
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
