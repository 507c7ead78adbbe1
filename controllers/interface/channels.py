"""The channels that an operator can command, and their order."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np

from handrail.controllers.arrays import BoolArray
from handrail.controllers.errors import unknown_name

if TYPE_CHECKING:  # the command line asks for names of channels, and shall not wait for a robot
    from handrail.controllers.robot.description import RobotDescription

BASE = ("base.vx", "base.vy", "base.wz")
_TWIST = ("vx", "vy", "vz", "wx", "wy", "wz")
TOOL = tuple(f"ee.{axis}" for axis in _TWIST)
_PAIR = (*(f"pair.{axis}" for axis in _TWIST), "apart.v")


@dataclass(frozen=True)
class Channels:
    """The command channels of a robot: twists of base and hands, both hands as a pair, joint velocities.

    The base twist is in the base frame [m/s, m/s, rad/s]; a hand's twist is (v, ω), world-aligned at its tool
    point [m/s, rad/s]. Of two hands `pair` is the mean of their twists, `apart` how fast their points part.
    Joint velocities are dq/dt, the base's in the world frame.
    """

    base: tuple[str, ...]  # names of the base twist channels, none on a fixed base
    hands: tuple[tuple[str, ...], ...]  # names of each hand's twist channels
    pair: tuple[str, ...]  # names of those of two hands together, none of one or of three
    joints: tuple[str, ...]  # names of the joint velocity channels
    moves: tuple[tuple[bool, ...], ...] = ()
    """Which joints move each hand; all where nothing is said."""

    @classmethod
    def of(cls, description: "RobotDescription") -> "Channels":
        """Return the channels of a robot."""
        joints = tuple(f"joint.{name}" for name in description.joints)
        hands = tuple(tuple(f"{hand.name or 'ee'}.{axis}" for axis in _TWIST) for hand in description.hands)
        base = BASE if description.base.joints else ()
        return cls(base, hands, _PAIR if len(hands) == 2 else (), joints, description.moves)

    @classmethod
    def named(cls, names: Iterable[str]) -> "Channels":
        """Return the channels that have these names, in their order."""
        groups = {kind: tuple(own) for kind, own in groupby(names, _kind)}
        base, joints = groups.pop("base", ()), groups.pop("joint", ())
        pair = (*groups.pop("pair", ()), *groups.pop("apart", ()))
        return cls(base, tuple(groups.values()), pair, joints)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """All channel names, in the order of `Intent.values`."""
        return (*self.base, *(name for hand in self.hands for name in hand), *self.pair, *self.joints)

    @property
    def size(self) -> int:
        """Number of channels m."""
        return len(self.names)

    @property
    def base_slice(self) -> slice:
        """Where the base twist lies."""
        return slice(0, len(self.base))

    def hand_slice(self, hand: int = 0) -> slice:
        """Return where a hand's twist lies."""
        start = len(self.base) + sum(map(len, self.hands[:hand]))
        return slice(start, start + len(self.hands[hand]))

    @property
    def hands_slice(self) -> slice:
        """Where the twists of all hands lie, those of the pair included."""
        return slice(len(self.base), self.size - len(self.joints))

    @property
    def grippers(self) -> tuple[str, ...]:
        """Names of the hands' grippers, as commands and recordings have them."""
        hands = [_kind(names[0]) for names in self.hands]
        return ("gripper",) if len(hands) == 1 else tuple(f"{hand}.gripper" for hand in hands)

    @property
    def pair_slice(self) -> slice:
        """Where the twist of the pair lies, and how fast it parts; empty of one hand."""
        end = self.size - len(self.joints)
        return slice(end - len(self.pair), end)

    @property
    def joint_slice(self) -> slice:
        """Where the joint velocities lie."""
        return slice(self.size - len(self.joints), self.size)

    def moving(self, hand: int) -> BoolArray:
        """Return which joints move a hand, (n,)."""
        return np.array(self.moves[hand] if self.moves else [True] * len(self.joints))

    def twist_mask(self, mask: BoolArray, hand: int) -> BoolArray:
        """Return which axes of a hand's twist are commanded, by itself or with the pair's, (6,)."""
        own = mask[self.hand_slice(hand)]
        return own | mask[self.pair_slice][:6] if self.pair else own

    @cached_property
    def _groups(self) -> dict[str, tuple[str, ...]]:
        """Names of channels by a name for them all."""
        groups = {kind: tuple(own) for kind, own in groupby(self.names, _kind)}
        groups["ee"] = tuple(name for hand in self.hands for name in hand)
        groups["arm"] = self.joints[len(self.base) :]
        if len(self.hands) > 1:
            carry = np.sum([self.moving(hand) for hand in range(len(self.hands))], axis=0) > 1
            carry[: len(self.base)] = False
            groups["torso"] = tuple(np.array(self.joints)[carry].tolist())
        for hand, names in enumerate(self.hands if len(self.hands) > 1 else ()):
            others = [self.moving(other) for other in range(len(self.hands)) if other != hand]
            own = self.moving(hand) & ~np.any(others, axis=0)
            groups[f"{_kind(names[0])}.arm"] = tuple(np.array(self.joints)[own].tolist())
        return groups

    def mask(self, *names: str) -> BoolArray:
        """Return the mask of some channels, by name or by group, (m,).

        Groups are `base`, `ee` (all hands), `joint`, `arm` (the joints that are not the base's), with several
        hands `torso` (joints that move more than one), of each by its name its twist and the joints of its
        arm alone (`left`, `left.arm`), and with two `pair` and `apart`.
        """
        mask = np.zeros(self.size, dtype=bool)
        for name in names:
            chosen = self._groups.get(name, (name,))
            if not self.have(name):
                raise unknown_name("channel", name, (*self._groups, *self.names))
            mask |= [channel in chosen for channel in self.names]
        return mask

    def arm(self, hand: int) -> BoolArray:
        """Return the mask of the joints of a hand's own arm, (m,)."""
        return self.mask(f"{_kind(self.hands[hand][0])}.arm" if len(self.hands) > 1 else "arm")

    def have(self, *names: str) -> bool:
        """Whether the robot has some channels, by name or by group."""
        found = [self._groups.get(name, (name,)) for name in names]
        return all(found) and all(set(each) <= set(self.names) for each in found)


def _kind(name: str) -> str:
    return name.split(".")[0]
