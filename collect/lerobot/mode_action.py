"""What LeRobot's action is: the channels of a teleop mode as plain numbers, and back."""

from collections.abc import Iterable, Mapping, Sequence
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from handrail.collect.lerobot.names import lerobot_name, named
from handrail.collect.operators.modes import TeleopMode
from handrail.collect.session.build import build_controller
from handrail.collect.session.loop import EpisodeLoop
from handrail.collect.session.mode_controller import ModeController
from handrail.collect.world.env import HandrailEnv
from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent, decided_gripper

# what a teleoperator presses: in its action beside the channels, and in no dataset
NEXT, AGAIN, HOLD = "handrail.next", "handrail.again", "handrail.hold"
BUTTONS = (NEXT, AGAIN, HOLD)
_FOCUS = "focus"
_HALF = 0.5  # a focus beyond it is the base's, a button beyond it is pressed


class ModeAction:
    """The action of a mode: every channel that it owns with some focus, the focus, and the grippers.

    Args:
        mode: teleop mode.
        channels: of the robot.
        hand: which of several hands does the task: its name.

    Attributes:
        names: LeRobot's, of the numbers; `focus` (0 hand, 1 base) only where the mode makes a difference.
    """

    def __init__(self, mode: TeleopMode, channels: Channels, hand: str = "") -> None:
        self._mode, self._channels = mode, channels
        self._hand, self._base = (channels.mask(*mode.owned(focus, hand)) for focus in ("hand", "base"))
        self._owned = np.flatnonzero(self._hand | self._base)
        focus = (_FOCUS,) if mode.by_focus else ()
        self._grippers = channels.grippers
        twists = [channels.hand_slice(number) for number in range(len(channels.hands))]
        pair = channels.pair_slice.start
        self._twists = [*twists, *([slice(pair, pair + 6)] if channels.pair else [])]
        self._own = (*(channels.names[i] for i in self._owned), *focus, *self._grippers)
        self.names = tuple(map(lerobot_name, self._own))

    @property
    def turns(self) -> bool:
        """Whether a twist can be turned: of each translation and rotation, the mode has all axes or none."""
        masks = (mask[part].reshape(2, 3) for mask in (self._hand, self._base) for part in self._twists)
        return all(np.array_equal(mask.any(axis=1), mask.all(axis=1)) for mask in masks)

    def intent(self, numbers: ArrayLike, time: float) -> Intent:
        """Return what numbers in the order of `names` ask for; one that is not finite brakes.

        A gripper beyond a half closes.
        """
        numbers, values = np.asarray(numbers, float), np.zeros(self._channels.size)
        values[self._owned] = numbers[: len(self._owned)] if np.isfinite(numbers).all() else np.nan
        focus, grippers = numbers[len(self._owned)], numbers[-len(self._grippers) :]
        mask = self._base if self._mode.by_focus and not focus <= _HALF else self._hand
        return Intent(values, mask, tuple(map(decided_gripper, grippers)), self._mode.name, time)

    def is_in(self, action: Mapping[str, float]) -> bool:
        """Whether an action has a channel of the mode."""
        return any(named(name, action) is not None for name in self._own[: -len(self._grippers)])

    def numbers(self, action: Mapping[str, float]) -> FloatArray:
        """Return the numbers of an action, by LeRobot's names or Handrail's own, in the order of `names`."""
        found = [named(name, action) for name in self._own]
        missing = [name for name, number in zip(self.names, found, strict=True) if number is None]
        if missing:
            raise HandrailError(
                f"action of handrail_sim: expected {', '.join(self.names)} for mode {self._mode.name};"
                f" missing: {', '.join(missing)}; a teleoperator of Handrail says them all"
            )
        return np.array(found, float)

    def action(self, intent: Intent, rotations: Sequence[FloatArray]) -> dict[str, float]:
        """Return an intent as an action, the hands' twists in the world's axes.

        Args:
            intent: what an operator asks for.
            rotations: of the tools, (3, 3) each, for an intent that is meant in their axes; a pair's is in
                those of the first.

        Raises:
            HandrailError: It is meant in the tool's axes, of which the mode has only some.
        """
        values = np.where(intent.mask, intent.values, 0.0)
        if intent.frames.tool == "tool":
            if not self.turns:
                raise HandrailError(
                    f"action of mode {self._mode.name}: expected a twist along the world's axes, "
                    "got one in the tool's, of which the mode has only some"
                )
            for part, rotation in zip(self._twists, (*rotations, rotations[0]), strict=False):
                values[part] = (values[part].reshape(2, 3) @ rotation.T).ravel()
        focus = (np.array_equal(intent.mask, self._base),) if self._mode.by_focus else ()
        numbers = (*values[self._owned], *focus, *intent.grippers)
        return dict(zip(self.names, map(float, numbers), strict=True))

    def still(self, grippers: Iterable[float] = ()) -> dict[str, float]:
        """Return the action of who touches nothing, with grippers as they are; open where nothing is said."""
        closed = zip(map(lerobot_name, self._grippers), grippers, strict=False)
        return dict.fromkeys(self.names, 0.0) | dict(closed)


def pressed(action: Mapping[str, float]) -> str:
    """Return the button that an action presses; "" if none."""
    return next((button for button in BUTTONS if float(action.get(button, 0.0)) > _HALF), "")


def mode_loop(env: HandrailEnv, task: str, mode: TeleopMode, also: TeleopMode) -> EpisodeLoop:
    """Return the loop of an environment in a mode; intents of another one are completed, too."""
    build = partial(build_controller, fps=env.fps, task=task)
    modes = {each.name: each for each in (also, mode)}
    return EpisodeLoop(env, ModeController(modes, build, mode, env.model))
