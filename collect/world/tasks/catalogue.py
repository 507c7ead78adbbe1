"""The tasks by name; light to import."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from handrail.controllers.errors import HandrailError
from handrail.controllers.registry import Registry

if TYPE_CHECKING:
    from handrail.controllers.robot.description import RobotDescription


@dataclass(frozen=True)
class TaskSpec:
    """A task: one entry makes it. A `module:name` is imported when it is built."""

    name: str  # as on the command line
    task: Callable[..., Any] | str  # its class, a `Task`
    script: Callable[..., Any] | str  # what a scripted person does, `(model, gains, drives) -> Script`
    help: str  # one line
    objectives: Callable[..., Any] | str | None = None
    """Objectives that the masked MPC adds by itself, `(channels, hand) -> (Objective, …)`; None: nothing."""
    released_channels: tuple[str, ...] = ()  # channels of the tool that the operator leaves to them
    owned_channels: tuple[str, ...] = ()
    """Channels that an operator who drives the base by itself keeps nevertheless."""
    movers: bool = False  # whether obstacles can move in it: the class has `moving_obstacles`
    hands: int = 1  # how many hands a robot needs for it
    large: bool = False  # whether its furniture comes in one size, for robots whose world has scale 1
    parts: bool = False  # whether its hands go ways of their own

    def refuses(self, groups: Sequence[str]) -> str:
        """Return how hands are to be steered, and how a mode's channel groups do; nothing if they fit."""
        if self.parts and any(group.startswith("pair") for group in groups):
            return "each hand steered by itself, as in mode both; got both hands as one"
        single = all(group in ("base", "hand", "torso") or group.startswith("ee.") for group in groups)
        return "both hands steered, as in mode both; got one at most" if self.hands > 1 and single else ""

    def lacks(self, robot: "RobotDescription") -> str:
        """Return what a robot would need for it, and what it has; nothing of one that can do it."""
        scale, hands = robot.world.scale, len(robot.hands)
        if hands < self.hands:
            return f"with {self.hands} hands, got {robot.name} with {hands}"
        small = self.large and scale < 1.0
        return f"whose world has scale 1, got {robot.name} with {scale}" if small else ""


_TASKS, _SCRIPTS = "handrail.collect.world.tasks", "handrail.collect.operators.scripted"
_TRAY = f"{_TASKS}.tray"
_APART: dict[str, Any] = {"hands": 2, "parts": True}
_LEVEL: dict[str, Any] = {
    "released_channels": ("ee.wx", "ee.wy"),  # its tilt is the MPC's
    "owned_channels": ("ee.vz",),  # who drives with it in hand minds how high it is
    "large": True,
}


def _spec(name: str, task: str, help: str, **options: Any) -> TaskSpec:
    """Return the spec of a task whose class and script are in modules of its name."""
    return TaskSpec(name, f"{_TASKS}.{name}:{task}", f"{_SCRIPTS}.{name}:{task}Script", help, **options)


TASKS = Registry(
    "task",
    TaskSpec,
    (
        _spec("carry_box", "CarryBox", "carry a box with both hands", hands=2, large=True),
        _spec("drawer", "Drawer", "pull it open", large=True),
        _spec("fetch", "Fetch", "hold the drawer open and take the cube out", **_APART, large=True),
        _spec("hand_over", "HandOver", "pass a bar from hand to hand into a bin", **_APART, large=True),
        _spec("pick_place", "PickPlace", "carry a cube into a bin"),
        _spec("reach", "Reach", "bring the hand to a pose", movers=True),
        _spec("reach_both", "ReachBoth", "bring each hand to a pose of its own", **_APART),
        _spec("tray", "Tray", "carry a tray with a can on it", objectives=f"{_TRAY}:level_tray", **_LEVEL),
        TaskSpec(
            "wide_tray",
            f"{_TRAY}:WideTray",
            f"{_SCRIPTS}.tray:TrayScript",
            "carry a tray with both hands",
            objectives=f"{_TRAY}:level_wide_tray",
            hands=2,
            **_LEVEL,
        ),
    ),
)


def check_robot(task: str, robot: "RobotDescription") -> None:
    """Check that a robot has the hands and the size for a task."""
    if lacks := TASKS.find(task).lacks(robot):
        able = ", ".join(spec.name for spec in TASKS.built_in if not spec.lacks(robot))
        raise HandrailError(f"task {task}: expected a robot {lacks}; it can do {able}")
