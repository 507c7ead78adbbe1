"""Teleop modes: which channels an operator owns, through which device, and what completes the rest."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Literal

from handrail.collect.operators.human.motion_goal import Focus
from handrail.collect.operators.human.steering import Gains
from handrail.controllers.errors import unknown_name
from handrail.controllers.interface.channels import TOOL

Completion = Literal["mpc", "direct", "filter", "cbf", "split"]
Device = Literal["sticks", "single_axis", "leader_arm"]
_POSITION_ORDER = 0.25 / 0.35  # refractory time of a position device over a velocity stick's


@dataclass(frozen=True)
class TeleopMode:
    """A named mask with an input map.

    Attributes:
        name: as on the command line.
        groups: channel groups that the operator owns, by focus.
        controller: what becomes of the command: `mpc` completes it, `filter` and `cbf` keep it safe, `direct`
            clips it to limits only, `split` does so too after inverse kinematics of the arm alone.
        help: one line.
        device: what the operator has in hand.
        drives: whether he drives the base by itself from place to place.
        gains: how briskly he steers; tuned for each mode on the same seeds.
        refractory: his refractory time over that of a velocity stick.
    """

    name: str
    groups: Callable[[Focus], tuple[str, ...]]
    controller: Completion
    help: str
    device: Device = "sticks"
    drives: bool = False
    gains: Gains = field(default_factory=Gains)
    refractory: float = 1.0


def _always(*groups: str) -> Callable[[Focus], tuple[str, ...]]:
    return lambda focus: groups


def _by_focus(focus: Focus) -> tuple[str, ...]:
    return ("base",) if focus == "base" else ("ee",)


MODES = {
    mode.name: mode
    for mode in (
        TeleopMode("ee", _always("ee"), "mpc", "steer the hand; the base comes along by itself"),
        TeleopMode("base", _always("base"), "mpc", "steer the base; the arm keeps clear by itself"),
        TeleopMode("base+ee", _always("base", "ee"), "mpc", "steer base and hand at once"),
        TeleopMode("joints", _always("joint"), "mpc", "steer every joint, kept safe by the MPC"),
        TeleopMode("switching", _by_focus, "mpc", "drive the base, then steer the hand", drives=True),
        TeleopMode(
            "direct",
            _always("joint"),
            "direct",
            "all joint velocities, clipped to limits only: the baseline",
        ),
        TeleopMode(
            "direct_filtered",
            _always("joint"),
            "filter",
            "all joint velocities through the multi-step predictive safety filter",
        ),
        TeleopMode(
            "direct_cbf", _always("joint"), "cbf", "all joint velocities through a one-step CBF safety filter"
        ),
        TeleopMode(
            "direct_single",
            _always("base", "arm"),
            "direct",
            "one axis of base or arm at a time, with a mode switch between",
            device="single_axis",
            drives=True,
            gains=Gains(gain=1.8, hand_speed=0.7, joint_rate=1.2, patience=4.0),
        ),
        TeleopMode(
            "leader",
            _always("base", "arm"),
            "direct",
            "a leader arm for the joints in one hand, a base stick in the other",
            device="leader_arm",
            drives=True,
            gains=Gains(gain=1.2, joint_rate=1.2),
            refractory=_POSITION_ORDER,
        ),
        TeleopMode(
            "decoupled",
            _by_focus,
            "split",
            "drive the base, or steer the hand by the arm's inverse kinematics alone",
            drives=True,
        ),
    )
}


def without(mode: TeleopMode, left: tuple[str, ...]) -> TeleopMode:
    """Return a mode whose operator leaves some tool channels alone, where the mode has them by group."""
    if not left:
        return mode
    kept = tuple(name for name in TOOL if name not in left)

    def groups(focus: Focus) -> tuple[str, ...]:
        return tuple(name for group in mode.groups(focus) for name in (kept if group == "ee" else (group,)))

    return replace(mode, groups=groups)


def minding(mode: TeleopMode, minded: tuple[str, ...]) -> TeleopMode:
    """Return a mode whose operator also owns some channels while he drives the base by itself."""
    if not minded or not mode.drives:
        return mode

    def groups(focus: Focus) -> tuple[str, ...]:
        return (*mode.groups(focus), *(minded if focus == "base" else ()))

    return replace(mode, groups=groups)


def find_mode(name: str) -> TeleopMode:
    """Return a mode by name.

    Raises:
        HandrailError: there is no such mode.
    """
    if name not in MODES:
        raise unknown_name("teleop mode", name, MODES)
    return MODES[name]
