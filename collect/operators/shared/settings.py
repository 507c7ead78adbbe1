"""How arbiters decide: their numbers."""

from dataclasses import dataclass

from handrail.controllers.typed import Fraction, NonNegative, Positive, check_settings

HANDBACK = 0.5  # after which what a person moved last goes back to the policy [s]


@dataclass(frozen=True)
class ArbiterSettings:
    """The numbers of all arbiters; each takes its own."""

    handback: NonNegative = HANDBACK
    """Time from the last input until channels go back to the policy [s]."""
    alpha: Fraction = 0.5
    """The policy's share where both ask (blend): 0 is `by_mask`, 1 the policy alone."""
    error: Positive = 0.5
    """Share of the policy's speed toward its goal that is missing when the level of autonomy switches (emics,
    hier_emics): 1 is a robot that makes no way."""
    window: Positive = 2.0
    """Time over which the missing way is averaged [s] (emics, hier_emics)."""
    dwell: NonNegative = 3.0
    """Shortest time between two switches, but for a person's [s] (emics, hier_emics)."""
    away: Positive = 10.0
    """Time without an input after which a person counts as away [s] (hier_emics)."""
    doubt: Positive = 0.1
    """Doubt from which the policy asks for help (risk): standard deviation of the velocities that an
    ensemble's members or denoising samples wish for, over full speed. Calibrate it on good episodes."""

    def __post_init__(self) -> None:
        """Check the numbers."""
        check_settings(self, "--arbitration.")
