"""Arbiters that go by what the person moves: by mask, wholly, or blended."""

import numpy as np

from handrail.collect.operators.shared.arbiter import Groups, Lately, Shares, Wishes
from handrail.collect.operators.shared.settings import ArbiterSettings


class ByMask:
    """What a person moves is theirs, the policy keeps the rest; let go, it is handed back after a moment.

    Args:
        groups: of the robot's channels.
        settings: how long after a group was moved last.
    """

    def __init__(self, groups: Groups, settings: ArbiterSettings) -> None:
        self._groups, self._lately = groups, Lately(groups, settings.handback)

    def reset(self) -> None:
        """Begin an episode."""
        self._lately.reset()

    def shares(self, wishes: Wishes) -> Shares:
        """Return 1 where a source is the owner, 0 elsewhere."""
        owned = self._lately.owned(wishes)
        return Shares(owned.astype(float), (~self._groups.taken(owned)).astype(float))


class Whole:
    """Any input takes everything, as long as something is moved and a moment more.

    Args:
        groups: of the robot's channels.
        settings: how long after the last input.
    """

    def __init__(self, groups: Groups, settings: ArbiterSettings) -> None:
        self._groups, self._lately = groups, Lately(groups, settings.handback)

    def reset(self) -> None:
        """Begin an episode."""
        self._lately.reset()

    def shares(self, wishes: Wishes) -> Shares:
        """Return 1 for whoever owns everything, 0 for the other."""
        person = float(self._lately.owned(wishes).any())
        return Shares(*(np.full(self._groups.channels.size, share) for share in (person, 1.0 - person)))


class Blend:
    """Both terms are in the MPC's objective, `(1 - α) ‖M_h (c - û_h)‖² + α ‖M_p (c - û_p)‖²`.

    While the person moves nothing that contradicts it, the policy has its full weight; so has the person
    where the policy owns nothing.

    Args:
        groups: of the robot's channels.
        settings: α, the policy's share, and how long after a group was moved last it counts as moved.
    """

    def __init__(self, groups: Groups, settings: ArbiterSettings) -> None:
        self._groups, self._alpha = groups, settings.alpha
        self._lately = Lately(groups, settings.handback)

    def reset(self) -> None:
        """Begin an episode."""
        self._lately.reset()

    def shares(self, wishes: Wishes) -> Shares:
        """Return both weights."""
        owned = self._lately.owned(wishes)
        policy = np.zeros_like(owned) if wishes.policy is None else wishes.policy.mask
        contested = self._groups.taken(owned) & policy
        opposed = owned & self._groups.taken(contested)
        person = np.where(opposed, 1.0 - self._alpha, 1.0) * owned
        return Shares(person, np.where(contested, self._alpha, 1.0))
