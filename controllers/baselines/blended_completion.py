"""Blended control: the operator's motion and an autonomous actor's, averaged with a fixed weight."""

from handrail.controllers.arrays import FloatArray
from handrail.controllers.baselines.twist_completion import Completion
from handrail.controllers.errors import HandrailError


class BlendedCompletion:
    """`v = α v_operator + (1 − α) v_autonomy`: weighted averaging, the paper's blended control; a completion.

    What both do with the hand passes whole, since a twist is linear in v; of what only one of them does with
    it, its share passes. An actor that knows nothing of the hand thus takes 1 − α of the operator's command.

    Args:
        operator: completes what the operator asks for.
        autonomy: what the autonomous actor does at the same time.
        alpha: α, the operator's share, from 0 to 1.

    Raises:
        HandrailError: the share is none.
    """

    def __init__(self, operator: Completion, autonomy: Completion, alpha: float = 0.5) -> None:
        if not 0.0 <= alpha <= 1.0:
            raise HandrailError(f"operator's share alpha: expected 0 to 1, got {alpha}")
        self._operator, self._autonomy, self._alpha = operator, autonomy, alpha

    def __call__(self, q: FloatArray, previous: FloatArray, twist: FloatArray, duration: float) -> FloatArray:
        """Return the velocity, (n,)."""
        operator = self._operator(q, previous, twist, duration)
        autonomy = self._autonomy(q, previous, twist, duration)
        return self._alpha * operator + (1.0 - self._alpha) * autonomy
