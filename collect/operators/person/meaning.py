"""From the operator's inputs, deflections and joint targets, to an intent on the mode's channels."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from handrail.collect.operators.modes import MASK, Focus, TeleopMode
from handrail.collect.operators.person.inputs import Input
from handrail.collect.operators.scripted.steering import FOLLOW, Gains, full_stick
from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.frames import Frames
from handrail.controllers.interface.intent import Intent, RawInput
from handrail.controllers.numerics.rotation import turned
from handrail.controllers.robot.model import RobotModel

HandFrame = Literal["world", "base", "tool", "view"]
HAND_FRAMES: tuple[HandFrame, ...] = ("world", "base", "tool", "view")


@dataclass(frozen=True)
class Setting:
    """The operator's choices."""

    mode: TeleopMode  # teleop mode
    focus: Focus = "hand"  # what they attend to, in a mode that makes a difference
    hand: str = ""  # the active one of several: which one a mode of one hand owns
    frame: HandFrame = "view"  # in which the hand's deflections are meant; `view` is as the person looks
    speed: float = 0.6  # share of full stick
    locked: tuple[int, ...] = ()  # joints that shall stand still, by index
    axis: int = -1  # the one that is steered, in a mode of one axis at a time; −1 before the first
    switches: int = 0  # how often mode, focus, hand, locks or that axis have changed in this episode

    @property
    def is_single(self) -> bool:
        """Whether only one axis is steered at a time."""
        return self.mode.device.startswith("single_axis")

    def switched(self, **changes: object) -> "Setting":
        """Return it with changes that count as a switch."""
        return replace(self, **changes, switches=self.switches + 1)  # pyright: ignore[reportArgumentType]


class InputMeaning:
    """Turns deflections into intents.

    Args:
        model: of the robot.

    Attributes:
        channels: of the robot.
        hands: names of its hands.
    """

    def __init__(self, model: RobotModel) -> None:
        self.channels = Channels.of(model.description)
        self.hands = tuple(hand.name for hand in model.description.hands)
        pair, count = self.channels.pair_slice.start, len(self.hands)
        self._twists = [self.channels.hand_slice(hand) for hand in range(count)]
        self._twists += [slice(pair, pair + 6)] if self.channels.pair else []
        self._apart = slice(pair + 6, self.channels.pair_slice.stop)
        self._base = len(self.channels.base)
        self._arm = slice(self.channels.joint_slice.start + self._base, self.channels.size)
        self._full = full_stick(self.channels, Gains().within(model.description.world))

    def fits(self, inputs: Input) -> bool:
        """Whether inputs are those of this robot."""
        arm = len(self.channels.joints) - self._base
        of_hands = len(inputs.grips) == len(self.hands)
        return len(inputs.axes) == self.channels.size and of_hands and len(inputs.targets) in (0, arm)

    def mask(self, setting: Setting) -> BoolArray:
        """Return the channels that the operator owns, (m,); of a pair also how fast it parts."""
        mask = self.channels.mask(*setting.mode.owned(setting.focus, setting.hand))
        mask[self._apart] |= self._is_pair(mask) and not setting.mode.name.startswith(MASK)
        mask[[self.channels.joint_slice.start + joint for joint in setting.locked]] = True
        return mask

    def _is_pair(self, mask: BoolArray) -> bool:
        return bool(mask[self.channels.pair_slice][:6].any())

    def parts(self, setting: Setting) -> dict[str, str]:
        """Return the hand, or `pair`, that parts of a device's axes stand for; nothing where none is steered.

        `ee` is what is steered: the active hand, the only one, or the pair; of two at once they are `one` and
        `two`.
        """
        mask, channels, active = self.mask(setting), self.channels, self.hands.index(setting.hand)
        names = [name or "ee" for name in self.hands]
        own = [n for n in range(len(names)) if mask[channels.hand_slice(n)].any()]
        if not own:
            return {"ee": "pair"} if mask[channels.pair_slice].any() else {}
        parts = {"ee": names[active if active in own else own[0]]}
        return parts | dict(zip(("one", "two"), names, strict=False)) if len(own) > 1 else parts

    def intent(
        self, inputs: Input, setting: Setting, state: State, age: float = 0.0, round_trip: float = 0.0
    ) -> Intent:
        """Return what is asked for: on every channel of the mode, deflection × full stick × speed.

        In a mode of one axis at a time only that of the setting counts, and the mask says which. How far a
        pair is apart is asked for while it is moved, else kept.
        Targets of the arm's joints are followed within that, `q̇ = k (q_target − q)`. Deflections of the base
        count in every mode that has the base in it, also where that means its joints.

        Args:
            inputs: where they are.
            setting: what the operator has chosen.
            state: of the robot.
            age: of the inputs [s].
            round_trip: of the frame that they answer [s].
        """
        mask, raw = self.mask(setting), np.array(inputs.axes)
        mask[self._apart] &= not self._is_pair(mask) or raw[self._apart] != 0
        if setting.is_single:
            alone = np.arange(mask.size) == setting.axis
            mask, raw = mask & alone, np.where(alone, raw, 0.0)
        values = setting.speed * self._full * raw
        joints = self.channels.joint_slice
        for twist in self._twists:
            values[twist] = self._hand(values[twist], inputs, setting, state)
        if self._base and mask[joints][: self._base].all() and not mask[self.channels.base_slice].any():
            values[joints.start : joints.start + self._base] += turned(
                values[self.channels.base_slice], state.q[2]
            )
        if inputs.targets and not setting.is_single:
            full = setting.speed * self._full[self._arm]
            toward = FOLLOW * (np.array(inputs.targets) - state.q[self._base :])
            values[self._arm] = np.clip(toward, -full, full)
            raw[self._arm] = inputs.targets
        values[[joints.start + joint for joint in setting.locked]] = 0.0
        return Intent(
            np.where(mask, values, 0.0),
            mask,
            grippers=tuple(map(float, inputs.grips)),
            mode=setting.mode.name,
            time=state.time,
            frames=Frames(tool="tool" if setting.frame == "tool" else "world"),
            raw=RawInput(raw, int(np.count_nonzero(raw)), setting.switches, inputs.device, age, round_trip),
        )

    def _hand(self, twist: FloatArray, inputs: Input, setting: Setting, state: State) -> FloatArray:
        """Return a twist of a hand in the world, or in the tool where it is meant there, (6,)."""
        if setting.frame in ("world", "tool"):
            return twist
        angle = inputs.view if setting.frame == "view" else state.q[2] if self._base else 0.0
        return np.concatenate([turned(twist[:3], angle), turned(twist[3:], angle)])
