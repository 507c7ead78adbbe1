"""LeRobot teleoperators that play back recorded actions, or move a hand; importing them takes LeRobot."""

import math
import time
from dataclasses import dataclass, field
from typing import Any

from lerobot.teleoperators.config import TeleoperatorConfig
from lerobot.teleoperators.teleoperator import Teleoperator

from handrail.collect.devices.calibration import LeaderCalibration, LeaderGripper, LeaderJoint

UR10 = ("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint")
UR10 += ("wrist_3_joint",)
DEGREE = 3.141592653589793 / 180.0
CALIBRATION = LeaderCalibration(
    {
        UR10[0]: LeaderJoint("shoulder_pan.pos", DEGREE, 1.0),
        UR10[2]: LeaderJoint("elbow_flex.pos", -DEGREE),
    },
    LeaderGripper("gripper.pos", closed=5.0, opened=70.0),
)
SOURCES = CALIBRATION.sources


@TeleoperatorConfig.register_subclass("played_leader")
@dataclass
class PlayedLeaderConfig(TeleoperatorConfig):
    """Settings of the one below.

    Attributes:
        port: which nobody opens.
        calibrated: what it says of itself.
        refuses: to be connected, with this error.
    """

    port: str = ""
    calibrated: bool = True
    refuses: str = ""


@dataclass
class Played:
    """What all of them say: actions in turn, then the last one on and on; exceptions are raised."""

    actions: list[Any] = field(default_factory=list)
    last: Any = None
    plugged: bool = True
    calibrated: bool = False


PLAYED = Played()


class PlayedLeader(Teleoperator):
    """Plays back."""

    config_class = PlayedLeaderConfig
    name = "played_leader"

    def __init__(self, config: PlayedLeaderConfig) -> None:
        super().__init__(config)
        self._config, self._connected = config, False

    @property
    def action_features(self) -> dict:
        return dict.fromkeys(SOURCES, float)

    @property
    def feedback_features(self) -> dict:
        return {}

    @property
    def is_connected(self) -> bool:
        return self._connected and PLAYED.plugged

    def connect(self, calibrate: bool = True) -> None:
        if self._config.refuses or not PLAYED.plugged:
            raise ConnectionError(self._config.refuses or "no such port")
        self._connected = True
        if calibrate and not self.is_calibrated:
            self.calibrate()

    @property
    def is_calibrated(self) -> bool:
        return self._config.calibrated or PLAYED.calibrated

    def calibrate(self) -> None:
        PLAYED.calibrated = True

    def configure(self) -> None:
        pass

    def get_action(self) -> Any:
        if not self.is_connected:
            raise ConnectionError("not connected")
        if PLAYED.actions:
            PLAYED.last = PLAYED.actions.pop(0)
        if isinstance(PLAYED.last, Exception):
            raise PLAYED.last
        return PLAYED.last

    def send_feedback(self, feedback: dict[str, Any]) -> None:
        pass

    def disconnect(self) -> None:
        self._connected = False


@TeleoperatorConfig.register_subclass("played_hand")
@dataclass
class PlayedHandConfig(PlayedLeaderConfig):
    """Settings of the one below."""


class PlayedHand(PlayedLeader):
    """Leads the hand ahead, and to and fro."""

    config_class = PlayedHandConfig
    name = "played_hand"

    @property
    def action_features(self) -> dict:
        return dict.fromkeys(("delta_x", "delta_y", "delta_z", "gripper"), float)

    def get_action(self) -> Any:
        return {"delta_x": 1.0, "delta_y": math.sin(time.monotonic()), "delta_z": 0.0, "gripper": 1.0}
