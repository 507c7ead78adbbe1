"""Shared by the tests of LeRobot's plugins: a robot and who steers it, outside LeRobot's commands."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from handrail.collect.lerobot import (
    HandrailScripted,
    HandrailScriptedConfig,
    HandrailSim,
    HandrailSimConfig,
)


@contextmanager
def steered(folder: Path, **settings) -> Iterator[tuple[HandrailSim, HandrailScripted]]:
    """A connected robot, as quick as it can, and a script that steers it."""
    robot = HandrailSim(HandrailSimConfig(calibration_dir=folder, realtime=False, **settings))
    teleop = HandrailScripted(HandrailScriptedConfig(calibration_dir=folder))
    teleop.connect()
    robot.connect()
    try:
        yield robot, teleop
    finally:
        robot.disconnect()
        teleop.disconnect()


def loop(robot: HandrailSim, teleop: HandrailScripted, frames: int) -> list[dict]:
    """Run what LeRobot's commands run; return what it would record of actions."""
    actions = []
    for _ in range(frames):
        robot.get_observation()
        action = teleop.get_action()
        robot.send_action(action)
        actions.append({name: action[name] for name in robot.action_features})
    return actions
