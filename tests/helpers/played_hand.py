"""A LeRobot teleoperator that says three numbers for the hand; importing it takes LeRobot."""

import math
import time
from dataclasses import dataclass
from typing import Any

from lerobot.teleoperators.config import TeleoperatorConfig
from lerobot.teleoperators.teleoperator import Teleoperator


@TeleoperatorConfig.register_subclass("played_hand")
@dataclass
class PlayedHandConfig(TeleoperatorConfig):
    """It has no settings."""


class PlayedHand(Teleoperator):
    """Leads the hand ahead, and to and fro."""

    config_class = PlayedHandConfig
    name = "played_hand"
    _connected = False

    @property
    def is_connected(self) -> bool:
        return self._connected

    @property
    def is_calibrated(self) -> bool:
        return True

    @property
    def action_features(self) -> dict[str, type]:
        return {"delta_x": float, "delta_y": float, "delta_z": float, "gripper": float}

    @property
    def feedback_features(self) -> dict[str, type]:
        return {}

    def connect(self, calibrate: bool = True) -> None:
        self._connected = True

    def calibrate(self) -> None:
        pass

    def configure(self) -> None:
        pass

    def get_action(self) -> dict[str, Any]:
        return {"delta_x": 1.0, "delta_y": math.sin(time.monotonic()), "delta_z": 0.0, "gripper": 1.0}

    def send_feedback(self, feedback: dict[str, Any]) -> None:
        pass

    def disconnect(self) -> None:
        self._connected = False
