"""What the controls of a device mean: one table, from a file, that a person may change.

A section says which axis a control moves while that part is steered: `[hand]`, `[turn]` (of the hand),
`[base]`, `[both]` (hand and base at once) and `[joints]`; `[actions]` says what a press asks for. Parts that
need the same controls are banks: the action `focus` goes from one to the next.
"""

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from handrail.controllers.errors import HandrailError, shown
from handrail.controllers.interface.channels import BASE, TOOL
from handrail.controllers.regular_file import open_regular

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
NOTHING = ""  # what a control of no meaning is mapped to
_FOLDER = Path(__file__).parent / "maps"

Moves = Mapping[str, tuple[str, int]]  # axis and sign of each control


@dataclass(frozen=True)
class ControlMap:
    """The table of a device.

    Attributes:
        moves: by section and control, the axis and its sign.
        actions: by control.
    """

    moves: Mapping[str, Moves]
    actions: Mapping[str, str]

    @property
    def is_held(self) -> bool:
        """Whether a control has to be held to move."""
        return "hold" in self.actions.values()

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
        both = hand and base and bool(of("both"))
        parts = [of("both", {})] if both else [of("hand", {})] if hand else []
        parts += [of("turn", {})] if hand else []
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
        number = {f"joint.{index + 1}": index for index in range(at_once)}
        return [
            {
                control: (chunk[number[axis]], sign)
                for control, (axis, sign) in section.items()
                if number[axis] < len(chunk)
            }
            for chunk in chunks
        ]


def load_map(device: str, controls: Iterable[str], changes: str = "") -> ControlMap:
    """Return the table of a device, with a person's changes.

    Args:
        device: its name.
        controls: that it has.
        changes: a .toml file of the same form, with the sections and controls that differ, or an empty path.
    """
    table = _read(_FOLDER / f"{device}.toml")
    if changes:
        path = Path(changes).expanduser()
        changed = _read(path)
        _check(changed, frozenset(controls), str(path))
        table = {name: table.get(name, {}) | changed.get(name, {}) for name in {**table, **changed}}
    moves = {
        name: {control: _axis(value) for control, value in section.items() if value}
        for name, section in table.items()
        if name != "actions"
    }
    return ControlMap(moves, {control: action for control, action in table["actions"].items() if action})


def _read(path: Path) -> dict[str, Any]:
    try:
        with open_regular(path) as file:
            return tomllib.load(file)
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise HandrailError(f"--teleop.map {path}: expected a .toml file: {error}") from error


def _axis(value: str) -> tuple[str, int]:
    return value.removeprefix("-"), -1 if value.startswith("-") else 1


def _check(table: dict[str, Any], controls: frozenset[str], where: str) -> None:
    """Check a person's table."""
    for name, section in table.items():
        if name not in (*SECTIONS, "actions") or not isinstance(section, dict):
            raise HandrailError(
                f"--teleop.map {where}: section {shown(name)}: "
                f"expected some of [{'], ['.join((*SECTIONS, 'actions'))}]"
            )
        choices = ACTIONS if name == "actions" else SECTIONS[name]
        for control, value in section.items():
            if control not in controls:
                raise HandrailError(
                    f"--teleop.map {where}: [{name}]: unknown control {shown(control)}: "
                    f"expected one of {', '.join(sorted(controls))}"
                )
            if value != NOTHING and (not isinstance(value, str) or value.removeprefix("-") not in choices):
                sign = "" if name == "actions" else '"-" before it turns it around, '
                raise HandrailError(
                    f"--teleop.map {where}: [{name}] {control}: expected one of {', '.join(choices)} "
                    f'({sign}"" takes it away), got {shown(value)}'
                )
