"""How arbiters decide: their numbers."""

from dataclasses import dataclass

from handrail.controllers.typed import Fraction, NonNegative, Positive, check_settings

HANDBACK = 0.5  # after which what a person moved last goes back to the policy [s]


@dataclass(frozen=True)
class ArbiterSettings:
    """The numbers of all arbiters; each takes its own."""

    handback: NonNegative = HANDBACK  # how long what a person moved stays theirs [s]
    alpha: Fraction = 0.5
    """The policy's share where both ask (blend): 0 is `by_mask`, 1 the policy alone."""
    error: Positive = 0.5
    """Share of the policy's speed toward its goal that is missing when the level of autonomy switches (emics,
    hier_emics): 1 is a robot that makes no way."""
    window: Positive = 2.0  # over which that is averaged (emics, hier_emics) [s]
    dwell: NonNegative = 3.0  # shortest time between two switches, but for a person's (emics, hier_emics) [s]
    away: Positive = 10.0  # who moves nothing for so long is not there (hier_emics) [s]
    doubt: Positive = 0.1
    """Doubt from which the policy asks for help (risk): standard deviation of the velocities that an
    ensemble's members or denoising samples wish for, over full speed. Calibrate it on good episodes."""

    def __post_init__(self) -> None:
        """Check the numbers."""
        check_settings(self, "--arbitration.")
