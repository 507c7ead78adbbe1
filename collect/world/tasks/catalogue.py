"""The tasks by name; light to import."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from handrail.controllers.registry import Registry


@dataclass(frozen=True)
class TaskSpec:
    """A task: one entry makes it. What is `module:name` is imported when it is built.

    Attributes:
        name: as on the command line.
        task: its class, a `Task`.
        script: what a scripted person does, `(model, gains, drives) -> Script`.
        help: one line.
        objectives: what the masked MPC looks after by itself, `(channels) -> (Objective, …)`; None: nothing.
        released_channels: channels of the tool that the operator leaves to them.
        owned_channels: channels that an operator who drives the base by itself keeps nevertheless.
        movers: whether obstacles can move in it: the class has `moving_obstacles`.
    """

    name: str
    task: Callable[..., Any] | str
    script: Callable[..., Any] | str
    help: str
    objectives: Callable[..., Any] | str | None = None
    released_channels: tuple[str, ...] = ()
    owned_channels: tuple[str, ...] = ()
    movers: bool = False


_TASKS, _SCRIPTS = "handrail.collect.world.tasks", "handrail.collect.operators.scripted"
TASKS = Registry(
    "task",
    TaskSpec,
    (
        TaskSpec("drawer", f"{_TASKS}.drawer:Drawer", f"{_SCRIPTS}.drawer:DrawerScript", "pull it open"),
        TaskSpec(
            "pick_place",
            f"{_TASKS}.pick_place:PickPlace",
            f"{_SCRIPTS}.pick_place:PickPlaceScript",
            "carry a cube into a bin",
        ),
        TaskSpec(
            "reach",
            f"{_TASKS}.reach:Reach",
            f"{_SCRIPTS}.reach:ReachScript",
            "bring the hand to a pose",
            movers=True,
        ),
        TaskSpec(
            "tray",
            f"{_TASKS}.tray:Tray",
            f"{_SCRIPTS}.tray:TrayScript",
            "carry a tray with a can on it",
            objectives=f"{_TASKS}.tray:level_tray",
            released_channels=("ee.wx", "ee.wy"),  # its tilt is the MPC's
            owned_channels=("ee.vz",),  # who drives with it in hand minds how high it is
        ),
    ),
)
