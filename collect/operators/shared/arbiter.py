"""An arbiter says how much a person and a policy each weigh on every channel now."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from handrail.collect.operators.shared.settings import ArbiterSettings
from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent

_MOVED = 1e-3  # of a commanded velocity: less is a hand that rests on its stick [m/s, rad/s]


@dataclass(frozen=True)
class Wishes:
    """The intents of a person and of a policy in this moment."""

    time: float  # of the robot's clock [s]
    person: Intent  # in the usual frames
    policy: Intent | None  # the same; None where the policy has no usable answer
    realised: FloatArray  # the velocity of every channel as it is, (m,)
    doubt: float = 0.0
    """How unsure the policy says it is: the standard deviation of the velocities that it could as well wish
    for, over full speed; 0 of one that does not say."""


class Shares(NamedTuple):
    """The weights of both on every channel, (m,) each; where a source owns nothing they mean nothing."""

    person: FloatArray
    policy: FloatArray


class Arbiter(Protocol):
    """Decides who owns what now."""

    def reset(self) -> None:
        """Begin an episode."""

    def shares(self, wishes: Wishes) -> Shares:
        """Return how much each weighs."""
        ...


@dataclass(frozen=True)
class Groups:
    """Channels that a person takes together: the base, a hand, the pair, each joint by itself.

    Args:
        channels: of the robot.
    """

    channels: Channels

    @cached_property
    def masks(self) -> dict[str, BoolArray]:
        """Each group's channels, (m,), by its name; none of a base or a pair that there is not."""
        channels = self.channels
        hands = {self.hand(number): names for number, names in enumerate(channels.hands)}
        groups = {"base": channels.base, **hands, "pair": channels.pair}
        groups |= {name: (name,) for name in channels.joints}
        return {name: channels.mask(*names) for name, names in groups.items()}

    def hand(self, number: int) -> str:
        """Return the name of a hand's group."""
        return self.channels.hands[number][0].split(".")[0]

    def moved(self, intent: Intent) -> BoolArray:
        """Return the channels of an intent's groups in which something is moved, (m,)."""
        still = bool(intent.raw.device) and not intent.raw.axes
        moves = intent.mask & (np.abs(np.nan_to_num(intent.values, nan=1.0)) > _MOVED)
        moves &= not still
        found = [mask for mask in self.masks.values() if np.any(moves & mask)]
        return intent.mask & np.any([np.zeros_like(moves), *found], axis=0)

    def taken(self, owned: BoolArray) -> BoolArray:
        """Return the channels that others lose to an owner of some, (m,): those and what contradicts them.

        The base's twist and its joints are the same motion. With a hand go the pair, and the joints of its
        arm alone; with all of these joints goes the hand. Joints that move a hand from afar (base, torso)
        stay: the MPC lets the arm make up for it.
        """
        lost, pair = owned.copy(), self.masks["pair"]
        base = self.masks["base"] | self.channels.mask(*self.channels.joints[: len(self.channels.base)])
        if np.any(owned & base):
            lost |= base
        for hand in range(len(self.channels.hands)):
            twist, arm = self.masks[self.hand(hand)], self.channels.arm(hand)
            if np.any(owned & (twist | pair)) or np.all(owned[arm]):
                lost |= twist | arm | pair
        return lost

    def grippers(self, owned: BoolArray) -> tuple[bool, ...]:
        """Return of which grippers an owner of channels has the hand, its pair, or a joint of its arm."""
        pair, hands = self.masks["pair"], range(len(self.channels.hands))
        arms = [self.masks[self.hand(hand)] | self.channels.arm(hand) | pair for hand in hands]
        return tuple(bool(np.any(owned & arm)) for arm in arms)


class Lately:
    """Remembers what a person moved lately: it stays theirs for a moment, so that a pause is no hand-back.

    Args:
        groups: of the robot's channels.
        settings: how long after it was moved last, and what an arbiter that goes by this needs besides.
    """

    def __init__(self, groups: Groups, settings: ArbiterSettings) -> None:
        self._groups, self._settings = groups, settings
        self.reset()

    def reset(self) -> None:
        """Begin an episode: nothing is the person's."""
        self._last = np.full(self._groups.channels.size, -np.inf)

    def owned(self, wishes: Wishes) -> BoolArray:
        """Return the channels that are the person's now, (m,); a clock that was set back changes nothing."""
        moved = self._groups.moved(wishes.person)
        self._last[moved] = wishes.time
        return moved | (wishes.person.mask & (np.abs(wishes.time - self._last) < self._settings.handback))
