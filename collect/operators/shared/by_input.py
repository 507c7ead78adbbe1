"""Arbiters that go by what the person moves: by mask, wholly, or blended."""

import numpy as np

from handrail.collect.operators.shared.arbiter import Lately, Shares, Wishes


class ByMask(Lately):
    """A person has the channels that they move, the policy the rest; let go, they go back after a moment."""

    def shares(self, wishes: Wishes) -> Shares:
        """Return 1 where a source is the owner, 0 elsewhere."""
        owned = self.owned(wishes)
        return Shares(owned.astype(float), (~self._groups.taken(owned)).astype(float))


class Whole(Lately):
    """Any input takes everything, as long as something is moved and a moment more."""

    def shares(self, wishes: Wishes) -> Shares:
        """Return 1 for whoever owns everything, 0 for the other."""
        person = float(self.owned(wishes).any())
        return Shares(*(np.full(self._groups.channels.size, share) for share in (person, 1.0 - person)))


class Blend(Lately):
    """Both terms are in the MPC's objective, `(1 - α) ‖M_h (c - û_h)‖² + α ‖M_p (c - û_p)‖²`.

    α is the policy's share. While the person moves nothing that contradicts it, the policy has its full
    weight; so has the person where the policy owns nothing.
    """

    def shares(self, wishes: Wishes) -> Shares:
        """Return both weights."""
        owned, alpha = self.owned(wishes), self._settings.alpha
        policy = np.zeros_like(owned) if wishes.policy is None else wishes.policy.mask
        contested = self._groups.taken(owned) & policy
        opposed = owned & self._groups.taken(contested)
        person = np.where(opposed, 1.0 - alpha, 1.0) * owned
        return Shares(person, np.where(contested, alpha, 1.0))
