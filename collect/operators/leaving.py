"""What an operator leaves to the task's objectives."""

from dataclasses import replace

from handrail.collect.operators.modes import Focus, TeleopMode
from handrail.controllers.interface.channels import TOOL


def leaving(mode: TeleopMode, left: tuple[str, ...], minded: tuple[str, ...]) -> TeleopMode:
    """Return a mode whose operator leaves some tool channels alone, and minds some while driving the base.

    Args:
        mode: to change; a mode that names single channels keeps them.
        left: channels of the tool that the group `ee` loses.
        minded: channels that are owned too while the operator, who steers by focus, drives the base.
    """
    kept = tuple(name for name in TOOL if name not in left)

    def groups(focus: Focus) -> tuple[str, ...]:
        own = tuple(name for group in mode.groups(focus) for name in (kept if group == "ee" else (group,)))
        return (*own, *(minded if mode.by_focus and focus == "base" else ()))

    return replace(mode, groups=groups) if left or minded else mode
