"""The policy asks for help: while it is unsure it drives nothing."""

from handrail.collect.operators.shared.arbiter import Shares, Wishes
from handrail.collect.operators.shared.by_input import ByMask

_CALM = 0.5  # of the doubt that asks for help: below it the policy drives again


class Risk(ByMask):
    """As `ByMask`; but while the policy is unsure, it has nothing: `doubt > δ`, until `doubt ≤ δ / 2`.

    If the person moves nothing then, nobody drives, and the robot brakes and waits for them. A doubt that is
    no number is one. An ensemble's spread as doubt is that of EnsembleDAgger (Menda et al., 2019); to ask at
    one threshold and to go on at a lower one that of ThriftyDAgger (Hoque et al., 2021), whose learned risk
    of failing and budget of interventions are not here.
    """

    def reset(self) -> None:
        """Begin an episode."""
        super().reset()
        self._asks = False

    def shares(self, wishes: Wishes) -> Shares:
        """Return 1 where a source is the owner, 0 elsewhere."""
        person, policy = super().shares(wishes)
        self._asks = not wishes.doubt <= self._settings.doubt * (_CALM if self._asks else 1.0)
        return Shares(person, policy * (not self._asks))
