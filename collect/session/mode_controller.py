"""A controller for each teleop mode, so that an operator may change mode and hand while the robot moves."""

from collections.abc import Callable, Mapping

from handrail.collect.operators.modes import MASK, TeleopMode, always
from handrail.collect.session.loop import Aiming
from handrail.controllers.arrays import BoolArray
from handrail.controllers.baselines.catalogue import CONTROLLERS
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Command
from handrail.controllers.interface.controller import Controller, State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.robot.model import Pose, RobotModel
from handrail.controllers.robot.shape import Obstacle


class ModeController:
    """Passes an intent on to the controller of its mode; a controller.

    No change makes the robot jolt: every controller begins with the velocity that was sent last.

    Args:
        modes: by name.
        build: makes the controller of a mode and a model; modes that say the same one share it.
        first: the mode at the beginning.
        model: of the robot.
    """

    def __init__(
        self,
        modes: Mapping[str, TeleopMode],
        build: Callable[[TeleopMode, RobotModel], Controller],
        first: TeleopMode,
        model: RobotModel,
    ) -> None:
        self._modes, self._build = modes, build
        self._model = self._meant = model
        self._channels = Channels.of(model.description)
        self._built: dict[tuple[str, bool, int], Controller] = {}
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
        self._meant = self._of_hand(intent.mask)
        if self._controller is not before:
            self._controller.reset(self._obstacles)
        return self._controller.update(state, intent)

    def aim(self, goal: Pose) -> None:
        """Say where the hand is to be brought now, to a controller that takes that."""
        if isinstance(self._controller, Aiming):
            self._controller.aim(goal)

    @property
    def _controller(self) -> Controller:
        which = self._mode.controller, self._mode.task_objectives, self._meant.number
        if which not in self._built:
            self._built[which] = self._build(self._mode, self._meant)
        return self._built[which]

    def _of_hand(self, mask: BoolArray) -> RobotModel:
        """Return the model that means the hand which is commanded; the masked MPC knows them all."""
        if not CONTROLLERS.find(self._mode.controller).objectives:
            for number, hand in enumerate(self._model.description.hands):
                if mask.ndim and mask[self._channels.hand_slice(number)].any():
                    return self._model.with_hand(hand.name)
        return self._model

    def _found(self, name: str) -> TeleopMode:
        """Return a mode; a mask of one's own is for the MPC, an unknown name changes nothing."""
        if name in self._modes or not name.startswith(MASK):
            return self._modes.get(name, self._mode)
        return TeleopMode(name, always(), "mpc", "a mask of one's own")
