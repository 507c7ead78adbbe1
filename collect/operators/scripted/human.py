"""How human an operator is: perception, delay, intermittency, noise, drift, switching; who it is."""

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace

import numpy as np

from handrail.controllers.typed import NonNegative, Positive, check_settings

_WIDEST = 2.0  # a person is at most this many standard deviations from the average


@dataclass(frozen=True)
class HumanSettings:
    """How human the operator is; all zero is a perfect one."""

    delay: NonNegative = 0.2  # Time from perception to hand [s]; 0.14–0.25 in people.
    refractory: NonNegative = 0.35  # Shortest time between two corrections [s]; 0.35 for a velocity stick.
    threshold: NonNegative = 0.03
    """Change of the wanted command, relative to full stick, below which the hand stays; of joints, as that
    moves the tool (`InputMap.fine`)."""
    noise: NonNegative = 0.1  # Standard deviation of the signal-dependent noise over |command|; about 0.1.
    drift: NonNegative = 0.02
    """Standard deviation of the drift over full stick, while the stick is deflected; likewise."""
    correlation: NonNegative = 0.5  # Time constant of noise, drift and misjudgement [s].
    switch_time: NonNegative = 0.3
    """Hands off the stick while changing to other inputs [s]; makes switching 17.4 % of the time when
    steering joint by joint."""
    movement: NonNegative = 0.15
    """Time of the hand from one deflection to the next, minimum jerk [s]."""
    misjudgement: NonNegative = 0.05
    """Standard deviation of a distance to go, or to turn, as it is seen, over that distance."""
    persons: NonNegative = 0.15
    """How much people differ, standard deviation of the logarithm of each number above."""
    moods: NonNegative = 0.08  # How much one person differs between episodes; unit as `persons`.
    briskness: Positive = 1.0
    """How briskly they steer, over what the device's gains say: a throughput of `briskness · gain / ln 2`
    [bit/s] (`Gains`); no weakness, so noise, persons and moods leave it."""

    def __post_init__(self) -> None:
        """Check the numbers."""
        check_settings(self, "--human")

    def scaled(self, factor: float) -> "HumanSettings":
        """Return the settings with every weakness but the correlation time multiplied by a factor."""
        return self._times([factor] * len(_WEAKNESSES), "correlation")

    def person(self, rng: np.random.Generator) -> "HumanSettings":
        """Draw a person around these settings: each number times `exp(persons · z)`."""
        return self._drawn(self.persons, rng)

    def episode(self, rng: np.random.Generator) -> "HumanSettings":
        """Draw how this person is in one episode: each number times `exp(moods · z)`."""
        return self._drawn(self.moods, rng)

    def _drawn(self, spread: float, rng: np.random.Generator) -> "HumanSettings":
        draws = np.clip(rng.standard_normal(len(_WEAKNESSES)), -_WIDEST, _WIDEST)
        return self._times(np.exp(spread * draws).tolist(), "persons", "moods")

    def _times(self, factors: Iterable[float], *kept: str) -> "HumanSettings":
        """Return the settings with every weakness multiplied, but for those that are kept."""
        pairs = zip(_WEAKNESSES, factors, strict=True)
        return replace(self, **{name: getattr(self, name) * by for name, by in pairs if name not in kept})


_WEAKNESSES = [entry.name for entry in fields(HumanSettings) if entry.name != "briskness"]
