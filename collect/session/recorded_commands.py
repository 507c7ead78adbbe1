"""The commands of a recorded episode, said again."""

import numpy as np

from handrail.controllers.interface.command import Command
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.shape import Obstacle


class RecordedCommands:
    """Says what was said in an episode, frame by frame, whatever is asked; a controller.

    Args:
        actions: velocities at the ends of the periods, and gripper, (T, n + 1).
        period: of a frame [s].
    """

    def __init__(self, actions: np.ndarray, period: float) -> None:
        self._actions, self._period = actions, period

    def reset(self, obstacles: tuple[Obstacle, ...] = ()) -> None:
        """Begin with the first frame."""
        self._frame = 0

    def update_scene(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Take no note of the scene."""

    def update(self, state: State, intent: Intent) -> Command:
        """Return the way to the next frame's velocities."""
        action, before = self._actions[self._frame].astype(np.float64), np.array(state.commanded)
        self._frame += 1
        velocities = np.stack([before, action[:-1], np.zeros(len(before))])
        return Command(velocities, self._period, gripper=float(action[-1]))
