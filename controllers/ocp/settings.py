"""Settings of the masked MPC."""

from dataclasses import dataclass
from typing import Annotated, Self

import numpy as np
from msgspec import Meta

from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.intent import DEAD_MAN_TIME
from handrail.controllers.typed import Count, NonNegative, Positive, check_settings

_LENGTHS = ("margin", "work_margin", "activation_distance", "largest_speed", "length")


@dataclass(frozen=True)
class MpcSettings:
    """Settings of the masked MPC; weights are per squared unit of their residual."""

    horizon: Annotated[int, Meta(ge=1, le=100)] = 10  # stages N
    dt: Positive = 0.1  # length of a stage [s]
    decay: Annotated[float, Meta(gt=0, le=1)] = 0.9  # γ; stage k tracks the intent with weight γᵏ
    tracked_stages: Count = 0  # stages M at which the intent is tracked; 0 for all
    tracking: NonNegative = 1000.0  # weight of the commanded channels, the tool's rotation left out
    turn_tracking: NonNegative = 1000.0  # weight of the tool's commanded rotation
    base_velocity: NonNegative = 0.01  # weight of base velocities that nobody commands
    arm_velocity: NonNegative = 0.1  # weight of arm velocities that nobody commands
    acceleration: NonNegative = 0.01  # weight of all accelerations
    posture: NonNegative = 0.05  # weight that draws the arm to its home posture while the tool is steered
    terminal_velocity: NonNegative = 0.1
    """Weight of the last velocity that nobody commands: the terminal cost V_f."""
    margin: NonNegative = 0.10  # signed distance kept between shapes [m]
    work_margin: NonNegative = 0.008  # the same between tool shapes and work surfaces [m]
    margin_share: NonNegative = 0.3  # share of the margin below which no pair comes in a stop
    activation_distance: NonNegative = 0.15
    """Distance beyond the margin at which a pair enters the problem [m]."""
    slack_linear: NonNegative = 1e6  # linear penalty of the slack
    slack_quadratic: Positive = 1e6  # quadratic penalty of the slack
    largest_speed: NonNegative = 2.0
    """Speed above which a commanded translation of the tool is taken as this [m/s]."""
    largest_rate: NonNegative = 4.0  # the same for its rotation [rad/s]
    intent_timeout: NonNegative = DEAD_MAN_TIME  # age from which an intent is stale [s]
    velocity_tolerance: NonNegative = 0.1
    """How far a robot that cannot follow may fall behind the commanded velocity before the plan waits for
    it, relative to the velocity limit; more than the measured velocity's noise."""

    length: Positive = 1.0
    """The length that weighs as much as one radian [m]: weights of translations are divided by its square;
    those of the terminal velocity and of the posture are not."""

    @classmethod
    def of(cls, scale: float, **values: float) -> Self:
        """Return the settings of a robot whose world has a scale; its lengths are made to that measure.

        Args:
            scale: `World.scale` of the robot.
            values: of other settings.
        """
        usual = cls()
        lengths = {name: scale * getattr(usual, name) for name in _LENGTHS}
        return cls(**(lengths | values))  # type: ignore[arg-type]

    def __post_init__(self) -> None:
        """Check the numbers."""
        check_settings(self, "MPC setting")

    def check_period(self, period: float, name: str) -> None:
        """Check that a loop is fast enough: only the plan's first stage is certified.

        Args:
            period: from one update to the next [s].
            name: of the setting that says so.
        """
        if period > self.dt * (1.0 + 1e-9):
            raise HandrailError(
                f"{name} {1.0 / period:g}: expected at least {1.0 / self.dt:g} Hz; the masked MPC certifies "
                f"{self.dt:g} s at a time, then the robot brakes"
            )

    @property
    def discounts(self) -> np.ndarray:
        """Share of the tracking weight at every stage: γᵏ while tracked, (N,)."""
        stages = np.arange(self.horizon)
        tracked = self.tracked_stages or self.horizon
        return self.decay**stages * (stages < tracked)
