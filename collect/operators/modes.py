"""Teleop modes by name: which channels an operator owns, with which device, before which controller."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import Literal

from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import TOOL, Channels
from handrail.controllers.registry import Registry

Focus = Literal["hand", "base"]


@dataclass(frozen=True)
class TeleopMode:
    """A teleop mode: one entry makes it."""

    name: str  # as on the command line
    groups: Callable[[Focus], tuple[str, ...]]
    """Channel groups that the operator owns, by focus: what they attend to now."""
    controller: str  # what becomes of the command: a name of `CONTROLLERS`, or `module:name`
    help: str  # one line
    device: str = "sticks"  # what the operator has in hand: a name of `DEVICES`
    task_objectives: bool = True
    """Whether the masked MPC takes on the objectives that a task brings, and the channels that the
    operator then leaves to them."""
    hands: int = 1  # how many hands a robot needs for it
    module: str = ""  # that has to be installed besides
    extra: str = ""  # of Handrail, which has it

    @property
    def available(self) -> bool:
        """Whether everything that it needs is installed."""
        return not self.module or find_spec(self.module) is not None

    def owned(self, focus: Focus, hand: str = "") -> tuple[str, ...]:
        """Return the channel groups that the operator owns; `hand` is the one of several that is meant."""
        name = hand or "ee"
        own = (name if group == "hand" else group for group in self.groups(focus))
        return tuple(name + group.removeprefix("ee") if group.startswith("ee.") else group for group in own)

    @property
    def by_focus(self) -> bool:
        """Whether the operator owns other channels while they drive the base."""
        return self.groups("base") != self.groups("hand")

    def leaving(self, released: tuple[str, ...], owned: tuple[str, ...]) -> "TeleopMode":
        """Return the mode of an operator who releases some tool channels, and owns some more while driving.

        Args:
            released: channels of the tool that the groups `hand` and `pair` lose; a mode that names channels
                keeps them.
            owned: channels that are owned too while the operator, who steers by focus, drives the base.
        """
        kept = tuple(name for name in TOOL if name not in released)
        parts = {"hand": kept, "pair": tuple(name.replace("ee.", "pair.") for name in kept)}

        def groups(focus: Focus) -> tuple[str, ...]:
            own = (name for group in self.groups(focus) for name in parts.get(group, (group,)))
            return (*own, *(owned if self.by_focus and focus == "base" else ()))

        return replace(self, groups=groups) if released or owned else self


def always(*groups: str) -> Callable[[Focus], tuple[str, ...]]:
    """Return the mask of some groups, whatever the focus."""
    return lambda focus: groups


def base_or_hand(focus: Focus) -> tuple[str, ...]:
    """Return the mask of the base's twist or the hand's."""
    return ("base",) if focus == "base" else ("hand",)


MASK = "mask:"  # the name of a mode of one's own begins so


def mode_of_mask(mask: str, channels: Channels, controller: str = "mpc") -> TeleopMode:
    """Return the mode of an operator who owns the channels of a mask, on velocity sticks.

    Args:
        mask: 0 or 1 for each channel.
        channels: of the robot.
        controller: what becomes of the command.
    """
    if set(mask) - {"0", "1"} or len(mask) != channels.size:
        raise HandrailError(
            f"--mask {mask}: expected {channels.size} characters 0 or 1, "
            f"one each for {', '.join(channels.names)}; got {len(mask)}"
        )
    names = tuple(name for name, bit in zip(channels.names, mask, strict=True) if bit == "1")
    return TeleopMode(MASK + mask, always(*names), controller, "a mask of one's own")


MODES = Registry(
    "mode",
    TeleopMode,
    (
        TeleopMode("ee", always("hand"), "mpc", "steer the hand; the base comes along by itself"),
        TeleopMode(
            "ee_whole",
            always("hand"),
            "mpc",
            "steer the hand, its tilt too: ee without the objectives that a task brings (tray)",
            task_objectives=False,
        ),
        TeleopMode(
            "ee_dls",
            always("hand"),
            "dls",
            "steer the hand; base and arm follow by damped least squares: ee without the MPC",
        ),
        TeleopMode("base", always("base"), "mpc", "steer the base; the arm keeps clear by itself"),
        TeleopMode("base+ee", always("base", "hand"), "mpc", "steer base and hand at once"),
        TeleopMode("joints", always("joint"), "mpc", "steer every joint, kept safe by the MPC"),
        TeleopMode("switching", base_or_hand, "mpc", "drive the base, then steer the hand"),
        TeleopMode(
            "direct", always("joint"), "direct", "all joint velocities, clipped to limits only: the baseline"
        ),
        TeleopMode(
            "direct_filtered",
            always("joint"),
            "filter",
            "all joint velocities through the multi-step predictive safety filter",
        ),
        TeleopMode(
            "direct_cbf", always("joint"), "cbf", "all joint velocities through a one-step CBF safety filter"
        ),
        TeleopMode(
            "direct_single",
            always("base", "arm"),
            "direct",
            "one axis of base or arm at a time, with a mode switch between",
            device="single_axis",
        ),
        TeleopMode(
            "leader",
            always("base", "arm"),
            "direct",
            "a leader arm for the joints in one hand, a base stick in the other",
            device="leader_arm",
        ),
        TeleopMode(
            "decoupled",
            base_or_hand,
            "split",
            "drive the base, or steer the hand by the arm's inverse kinematics alone",
        ),
        TeleopMode("both", always("ee"), "mpc", "steer all hands at once, each by itself", hands=2),
        TeleopMode(
            "pair",
            always("pair"),
            "mpc",
            "steer two hands as one, which stay as they are to each other",
            hands=2,
        ),
        TeleopMode(
            "hand+torso",
            always("hand", "torso"),
            "mpc",
            "steer the hand and the joints that carry all arms",
            hands=2,
        ),
        # LeRobot's plugin writes a mode as its place here: new ones come last
        TeleopMode(
            "ee_filtered", always("hand"), "filter", "steer the hand, through the multi-step safety filter"
        ),
        TeleopMode("ee_cbf", always("hand"), "cbf", "steer the hand, through a one-step CBF safety filter"),
        TeleopMode(
            "blended",
            always("hand"),
            "blended",
            "steer the hand; an actor that knows the goal helps as far as both want the same",
        ),
        TeleopMode(
            "ee_dls_base",
            always("hand"),
            "dls_base",
            "steer the hand; damped least squares with ee's weights: ee without horizon and distances",
        ),
        TeleopMode(
            "ee_mink",
            always("hand"),
            "handrail.collect.world.mink:MINK",
            "steer the hand; whole-body inverse kinematics that keeps distances: ee without horizon",
            module="mink",
            extra="profile",
        ),
        TeleopMode(
            "ee_one_stage", always("hand"), "mpc_one_stage", "steer the hand: ee with a horizon of one stage"
        ),
        TeleopMode(
            "direct_erring",
            always("base", "arm"),
            "direct",
            "direct_single by a script that errs: takes a wrong joint, pushes the wrong way at first",
            device="single_axis_erring",
        ),
    ),
)
