"""LeRobot's plugins: its own commands drive the simulated robots, and people and scripts steer through them.

`--robot.discover_packages_path=handrail.collect.lerobot` lets LeRobot find them: importing this registers

    robot.type   handrail_sim
    teleop.type  handrail_scripted, handrail_cockpit, handrail_gamepad
    env.type     handrail
    a step of processors: handrail_masked_mpc
"""

import handrail.collect.processor.mpc_step  # noqa: F401  (registers the step)
from handrail.collect.lerobot.config_env import HandrailEnvConfig
from handrail.collect.lerobot.configs import (
    HandrailCockpitConfig,
    HandrailGamepadConfig,
    HandrailScriptedConfig,
    HandrailSimConfig,
)
from handrail.collect.lerobot.person import HandrailCockpit, HandrailGamepad
from handrail.collect.lerobot.scripted import HandrailScripted
from handrail.collect.lerobot.sim import HandrailSim

__all__ = [  # LeRobot looks for the classes here, by the names of their configs
    "HandrailCockpit",
    "HandrailCockpitConfig",
    "HandrailEnvConfig",
    "HandrailGamepad",
    "HandrailGamepadConfig",
    "HandrailScripted",
    "HandrailScriptedConfig",
    "HandrailSim",
    "HandrailSimConfig",
]
