"""A robot of LeRobot's in this process, exact or lame, driven through the processor step."""

from dataclasses import dataclass, field

import numpy as np
from device_players import Clock

from handrail.collect.processor.mpc_step import MaskedMpcStep, mpc_pipeline
from handrail.collect.processor.units import RobotUnits, robot_units
from handrail.collect.processor.whole_body import moved
from handrail.controllers.robot.model import load_model

PERIOD = 1.0 / 30.0


@dataclass
class PlainRobot:
    """Goes exactly where it is sent, and has no odometry; remembers where its base really is."""

    units: RobotUnits
    arm: np.ndarray
    pose: np.ndarray = field(default_factory=lambda: np.zeros(3))
    twist: np.ndarray = field(default_factory=lambda: np.zeros(3))
    grips: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        self.grips = np.zeros(len(self.units.grippers))

    def observation(self) -> dict:
        return self.units.action(self.arm, np.zeros(len(self.arm)), self.twist, self.grips)

    def send(self, action: dict, period: float = PERIOD) -> None:
        reading = self.units.read(action)
        assert reading is not None, action
        self.pose = moved(self.pose, 0.5 * (self.twist + reading.twist), period)
        self.arm, self.twist, self.grips = reading.arm, reading.twist, 1.0 - reading.openings


class Drive:
    """A step with its robot and its clock."""

    def __init__(self, **settings) -> None:
        self.clock = Clock()
        self.step = MaskedMpcStep(**({"fps": 30.0} | settings), clock=self.clock)
        self.model = load_model(self.step.robot)
        units = robot_units(self.step.units, self.model.description)
        base = len(self.model.description.base.joints)
        self.robot = PlainRobot(units, self.model.description.home[base:].copy())
        self.pipeline = mpc_pipeline(self.step)
        self.sent: list[dict] = []

    def go(self, action: dict, seconds: float = PERIOD, period: float = PERIOD) -> dict:
        """Ask for the same again and again; return what was sent last."""
        for _ in range(round(seconds / period)):
            self.sent.append(self.pipeline((action, self.robot.observation())))
            self.robot.send(self.sent[-1], period)
            self.clock.now += period
        return self.sent[-1]

    @property
    def hand(self) -> np.ndarray:
        base = self.robot.pose[: len(self.model.description.base.joints)]
        return self.model.pose(np.append(base, self.robot.arm)).position

    def moves(self, action: dict) -> bool:
        """Whether an action moves the robot from where it is."""
        before = self.robot.observation()
        return any(
            abs(action[n] - before[n]) > 1e-9 if n.endswith(".pos") else abs(action[n]) > 1e-9 for n in action
        )
