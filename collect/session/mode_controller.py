"""A controller for each teleop mode, so that an operator may change the mode while the robot moves."""

from collections.abc import Callable, Mapping

from handrail.collect.operators.modes import MASK, TeleopMode, always
from handrail.controllers.interface.command import Command
from handrail.controllers.interface.controller import Controller, State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.shape import Obstacle


class ModeController:
    """Passes an intent on to the controller of its mode; a controller.

    No change makes the robot jolt: every controller begins with the velocity that was sent last.

    Args:
        modes: by name.
        build: makes the controller of a mode; modes that say the same one share it.
        first: the mode at the beginning.
    """

    def __init__(
        self, modes: Mapping[str, TeleopMode], build: Callable[[TeleopMode], Controller], first: TeleopMode
    ) -> None:
        self._modes, self._build = modes, build
        self._built: dict[tuple[str, bool], Controller] = {}
        self._obstacles: tuple[Obstacle, ...] = ()
        self._mode = first

    def reset(self, obstacles: tuple[Obstacle, ...] = ()) -> None:
        """Forget the past; take the obstacles of a new episode."""
        self._obstacles = obstacles
        self._controller.reset(obstacles)

    def update_scene(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Take what stands around now."""
        self._obstacles = obstacles
        self._controller.update_scene(obstacles)

    def update(self, state: State, intent: Intent) -> Command:
        """Return the command of the mode's controller."""
        before, self._mode = self._controller, self._found(intent.mode)
        if self._controller is not before:
            self._controller.reset(self._obstacles)
        return self._controller.update(state, intent)

    @property
    def _controller(self) -> Controller:
        which = self._mode.controller, self._mode.task_objectives
        if which not in self._built:
            self._built[which] = self._build(self._mode)
        return self._built[which]

    def _found(self, name: str) -> TeleopMode:
        """Return a mode; a mask of one's own is for the MPC, an unknown name changes nothing."""
        if name in self._modes or not name.startswith(MASK):
            return self._modes.get(name, self._mode)
        return TeleopMode(name, always(), "mpc", "a mask of one's own")
