"""Settings of the masked MPC."""

from dataclasses import dataclass, fields
from typing import Self

import numpy as np

from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.intent import DEAD_MAN_TIME

_LENGTHS = ("margin", "work_margin", "activation_distance", "largest_speed", "length")


@dataclass(frozen=True)
class MpcSettings:
    """Settings of the masked MPC; weights are per squared unit of their residual.

    Attributes:
        horizon: stages N.
        dt: length of a stage [s].
        decay: γ; stage k tracks the intent with weight γᵏ.
        tracked_stages: stages M at which the intent is tracked; 0 for all.
        tracking: weight of the commanded channels, the tool's rotation left out.
        turn_tracking: weight of the tool's commanded rotation.
        base_velocity: weight of base velocities that nobody commands.
        arm_velocity: weight of arm velocities that nobody commands.
        acceleration: weight of all accelerations.
        posture: weight that draws the arm to its home posture while the tool is steered.
        terminal_velocity: weight of the last velocity that nobody commands: the terminal cost V_f.
        margin: signed distance kept between shapes [m].
        work_margin: the same between tool shapes and work surfaces [m].
        margin_share: share of the margin below which no pair comes in a stop.
        activation_distance: distance beyond the margin at which a pair enters the problem [m].
        slack_linear: linear penalty of the slack.
        slack_quadratic: quadratic penalty of the slack.
        largest_speed: speed above which a commanded translation of the tool is taken as this [m/s].
        largest_rate: the same for its rotation [rad/s].
        intent_timeout: age from which an intent is stale [s].
        velocity_tolerance: how far a robot that cannot follow may fall behind the commanded velocity before
            the plan waits for it, relative to the velocity limit; more than the measured velocity's noise.
        length: what weighs as much as one radian [m]: weights of translations are divided by its square.
    """

    horizon: int = 10
    dt: float = 0.1
    decay: float = 0.9
    tracked_stages: int = 0
    tracking: float = 1000.0
    turn_tracking: float = 1000.0
    base_velocity: float = 0.01
    arm_velocity: float = 0.1
    acceleration: float = 0.01
    posture: float = 0.05
    terminal_velocity: float = 0.1
    margin: float = 0.10
    work_margin: float = 0.008
    margin_share: float = 0.3
    activation_distance: float = 0.15
    slack_linear: float = 1e6
    slack_quadratic: float = 1e6
    largest_speed: float = 2.0
    largest_rate: float = 4.0
    intent_timeout: float = DEAD_MAN_TIME
    velocity_tolerance: float = 0.1

    length: float = 1.0

    @classmethod
    def of(cls, scale: float, **values: float) -> Self:
        """Return the settings of a robot whose world has a scale; its lengths are made to that measure.

        Args:
            scale: `World.scale` of the robot.
            values: of other settings.
        """
        usual = cls()
        lengths = {name: scale * getattr(usual, name) for name in _LENGTHS}
        return cls(**lengths, **values)  # type: ignore[arg-type]

    def __post_init__(self) -> None:
        """Check the numbers."""
        for entry in fields(self):
            value = getattr(self, entry.name)
            if not np.isfinite(value) or value < 0:
                raise HandrailError(f"MPC setting {entry.name}: expected a finite number >= 0, got {value}")
        if self.horizon < 2 or self.dt <= 0 or not 0 < self.decay <= 1:
            raise HandrailError(
                "MPC settings horizon, dt, decay: expected horizon >= 2, dt > 0, 0 < decay <= 1, "
                f"got {self.horizon}, {self.dt}, {self.decay}"
            )
        if not self.length:
            raise HandrailError("MPC setting length: expected a number > 0, got 0")

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
