"""What the terminal shows a person: how it stands, what to do, where the hand has to go, what the keys do."""

from collections.abc import Sequence

import numpy as np
from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from handrail.collect.devices.control_map import ControlMap, Moves, actions_help, control_of, moves_help
from handrail.collect.operators.operator import View
from handrail.collect.operators.person.meaning import HandFrame
from handrail.collect.operators.person.person import Person, Phase
from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.command import Status
from handrail.controllers.numerics.rotation import rotation_vector, turned
from handrail.controllers.robot.model import Pose

_COLOURS = {Phase.DRIVING: "green", Phase.LOST: "red", Phase.STOPPED: "red"}
_MOST_SHOWN = 0.005  # smaller is zero [m, rad]


class Card:
    """A panel in the terminal, beside the recording's progress bar.

    Args:
        device: in hand.
        tables: maps of the devices, for the help.
        base: how many joints of the robot are its base's.
    """

    def __init__(self, device: str, tables: Sequence[ControlMap], base: int) -> None:
        self._device, self._tables, self._base = device, tables, base
        self._task, self._horizon, self._said = "", 0.0, ""
        self._brakes = ""
        self._is_helping = True
        self._title, self._colour = self._device, "yellow"
        self._lines: tuple[str, ...] = ()
        self._moves: Moves = {}

    def begin(self, task: str, horizon: float) -> None:
        """Take the task of a new episode, and its time limit [s]."""
        self._task, self._horizon, self._brakes = task, horizon, ""

    def see(self, status: Status) -> None:
        """Take how the controller fares."""
        self._brakes = f"braking: {status.value.replace('_', ' ')}" if status.brakes else ""

    def say(self, words: str) -> None:
        """Show what became of the last episode."""
        self._said = words

    def turn_over(self) -> None:
        """Show the help, or hide it."""
        self._is_helping = not self._is_helping

    def show(
        self, view: View, person: Person, moves: Moves, trouble: str, grip: bool, apart: float | None
    ) -> None:
        """Take how it stands.

        Args:
            view: what the operator sees.
            person: whoever steers.
            moves: of the device, in force now.
            trouble: with a device, and what to do.
            grip: whether the gripper shall be closed.
            apart: how far a leader arm stands from the robot's arm, at most [rad]; none without a leader.
        """
        setting = person.setting
        chosen = [setting.mode.name]
        if setting.mode.by_focus:
            chosen.append(f"the {setting.focus}")
        if person.meaning.mask(setting)[person.meaning.channels.tool_slice].any():
            chosen.append(f"frame {setting.frame}")
        chosen += [f"speed {setting.speed:.0%}", f"gripper {'closed' if grip else 'open'}"]
        chosen += [] if apart is None else [f"leader {np.degrees(apart):.0f}° from the arm"]
        left = max(0.0, self._horizon - view.state.time)
        practice = ", practice: not recorded" if person.practises else ""
        self._title = f"{self._device}: {person.phase.value}{practice}"
        self._colour = _COLOURS.get(person.phase, "yellow")
        self._moves = moves
        frame: HandFrame = "world" if setting.frame == "view" else setting.frame
        self._lines = (
            f"{self._task}  {left:.0f} s left" + (f"  last episode {self._said}" if self._said else ""),
            trouble or self._advice(person.phase) + (f"  {self._brakes}" if self._brakes else ""),
            "mode " + ", ".join(chosen),
            *self._way(view, frame),
        )

    def __rich__(self) -> RenderableType:
        """Return the panel."""
        parts: list[RenderableType] = [Text(line) for line in self._lines]
        if self._is_helping:
            parts.append(self._help())
        return Panel(Group(*parts), title=self._title, title_align="left", border_style=self._colour)

    def _advice(self, phase: Phase) -> str:
        """Return what to do next."""
        start = control_of(self._tables, "start", "start_or_pause")
        hold = control_of(self._tables, "hold") or control_of(self._tables, "clutch")
        ends, saves = control_of(self._tables, "quit"), control_of(self._tables, "success")
        lost = f"; {ends} ends the recording without this episode, {saves} saves it first" if ends else ""
        return {
            Phase.READY: f"press {start} to begin",
            Phase.PAUSED: f"paused; press {start} to go on{lost}",
            Phase.LOST: "stands still: let go of everything" + (f", then hold {hold}" if hold else ""),
            Phase.STOPPED: f"emergency stop; {start} releases it",
            Phase.DRIVING: f"hold {hold} to move" if hold else "drive",
        }[phase]

    def _help(self) -> Table:
        table = Table.grid(padding=(0, 2))
        rows = moves_help(self._moves)
        rows += [line for controls in self._tables for line in actions_help(controls)]
        half = (len(rows) + 1) // 2
        for left, right in zip(rows[:half], [*rows[half:], ("", "")], strict=False):
            table.add_row(Text(left[0], "bold"), left[1], Text(right[0], "bold"), right[1])
        return table

    def _way(self, view: View, frame: HandFrame) -> tuple[str, ...]:
        """Return where the hand has to go still, on the axes that the controls move it along."""
        goal = view.task.goal
        if goal is None:
            return ()
        turn = view.state.q[2] if frame == "base" and self._base else 0.0
        error = hand_error(view.tool, goal, turn, frame == "tool")
        words = ("forward", "left", "up", "roll", "tip", "turn")
        shown = (f"{word} {value:+.2f}" for word, value in zip(words, _tidy(error), strict=True))
        return (f"to the goal: {', '.join(shown)}  [m, rad; frame {frame}]",)


def hand_error(tool: Pose, goal: Pose, turn: float, in_tool: bool) -> FloatArray:
    """Return the way and the turn from the hand to its goal [m, rad], (6,).

    Args:
        tool: the hand.
        goal: where it has to go.
        turn: of the frame about the vertical [rad].
        in_tool: on the hand's own axes instead.
    """
    way, rotation = goal.position - tool.position, rotation_vector(goal.rotation @ tool.rotation.T)
    if in_tool:
        return np.concatenate([tool.rotation.T @ way, tool.rotation.T @ rotation])
    return np.concatenate([turned(way, -turn), turned(rotation, -turn)])


def _tidy(values: FloatArray) -> FloatArray:
    return np.where(np.abs(values) < _MOST_SHOWN, 0.0, values)
