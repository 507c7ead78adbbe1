"""The terminal's text for a person: the state, what to do, where the hand has to go, what the keys do."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from handrail.collect.devices.control_map import ControlMap, Moves, actions_help, control_of, moves_help
from handrail.collect.operators.operator import View
from handrail.collect.operators.person.person import Person, Phase
from handrail.collect.operators.scripted.steering import hand_errors
from handrail.controllers.numerics.rotation import turned

_COLOURS = {Phase.DRIVING: "green", Phase.LOST: "red", Phase.STOPPED: "red"}
_MOST_SHOWN = 0.005  # smaller is zero [m, rad]


@dataclass
class Card:
    """A panel in the terminal, beside the recording's progress bar; whoever steers keeps it up to date."""

    person: Person
    device: str
    """In hand."""
    tables: Sequence[ControlMap]
    """Maps of the devices, for the help."""
    task: str = ""
    time_limit: float = 0.0
    """Time limit of the episode [s]."""
    before: str = ""
    """The outcome of the last episode."""
    brakes: str = ""
    """Why the controller brakes."""
    is_helping: bool = True
    view: View | None = None
    moves: Moves = field(default_factory=dict)
    """Of the device, in force now."""
    trouble: str = ""
    """With a device, and what to do."""
    grips: Sequence[float] = (0.0,)
    """How far each gripper shall be, 0 open to 1 closed, one a hand."""
    apart: float | None = None
    """How far a leader arm stands from the robot's arm, at most [rad]; none without a leader."""

    def __rich__(self) -> RenderableType:
        """Return the panel."""
        phase, view = self.person.phase, self.view
        practice = ", practice: not recorded" if self.person.practises else ""
        parts: list[RenderableType] = [Text(line) for line in self._lines(view)] if view else []
        if self.is_helping:
            parts.append(self._help())
        title = f"{self.device}: {phase.value}{practice}"
        return Panel(
            Group(*parts), title=title, title_align="left", border_style=_COLOURS.get(phase, "yellow")
        )

    def _lines(self, view: View) -> tuple[str, ...]:
        setting, meaning = self.person.setting, self.person.meaning
        chosen = [setting.mode.name]
        if setting.mode.by_focus:
            chosen.append(f"the {setting.focus}")
        if meaning.mask(setting)[meaning.channels.hands_slice].any():
            chosen.append(f"frame {setting.frame}")
        if len(meaning.hands) > 1:
            chosen.append(f"active hand {setting.hand}")
        chosen.append(f"speed {setting.speed:.0%}")
        for hand, closed in zip(meaning.hands, self.grips, strict=True):
            chosen.append(f"{hand} gripper {'closed' if closed > 0.5 else 'open'}".strip())
        chosen += [] if self.apart is None else [f"leader {np.degrees(self.apart):.0f}° from the arm"]
        left = max(0.0, self.time_limit - view.state.time)
        return (
            f"{self.task}  {left:.0f} s left" + (f"  last episode {self.before}" if self.before else ""),
            self.trouble or self._advice() + (f"  braking: {self.brakes}" if self.brakes else ""),
            "mode " + ", ".join(chosen),
            *self._way(view),
        )

    def _advice(self) -> str:
        """Return what to do next."""
        start = control_of(self.tables, "start", "start_or_pause")
        hold = control_of(self.tables, "hold") or control_of(self.tables, "clutch")
        ends, saves = control_of(self.tables, "quit"), control_of(self.tables, "success")
        lost = f"; {ends} ends the recording without this episode, {saves} saves it first" if ends else ""
        return {
            Phase.READY: f"press {start} to begin",
            Phase.PAUSED: f"paused; press {start} to go on{lost}",
            Phase.LOST: "stands still: let go of everything" + (f", then hold {hold}" if hold else ""),
            Phase.STOPPED: f"STOPPED; {start} releases it",
            Phase.DRIVING: f"hold {hold} to move" if hold else "drive",
        }[self.person.phase]

    def _help(self) -> Table:
        table = Table.grid(padding=(0, 2))
        rows = moves_help(self.moves, self.person.meaning.parts(self.person.setting))
        rows += [line for controls in self.tables for line in actions_help(controls)]
        half = (len(rows) + 1) // 2
        for left, right in zip(rows[:half], [*rows[half:], ("", "")], strict=False):
            table.add_row(Text(left[0], "bold"), left[1], Text(right[0], "bold"), right[1])
        return table

    def _way(self, view: View) -> tuple[str, ...]:
        """Return where the hand has to go still, on the axes that the controls move it along."""
        if view.task.goal is None:
            return ()
        frame, errors = self.person.setting.frame, hand_errors(view.tool, view.task.goal).reshape(2, 3)
        if frame == "tool":
            errors = errors @ view.tool.rotation
        elif frame == "base" and len(self.person.meaning.channels.base):
            errors = np.array([turned(error, -view.state.q[2]) for error in errors])
        tidy = np.where(np.abs(errors) < _MOST_SHOWN, 0.0, errors).ravel()
        words = ("forward", "left", "up", "roll", "tip", "turn")
        shown = (f"{word} {value:+.2f}" for word, value in zip(words, tidy, strict=True))
        return (f"to the goal: {', '.join(shown)}  [m, rad; frame {frame}]",)
