"""LeRobot's plugins: its own commands drive the simulated robots, and people and scripts steer through them.

`--robot.discover_packages_path=handrail.collect.lerobot` lets LeRobot find them: importing this registers

    robot.type   handrail_sim
    teleop.type  handrail_scripted
    env.type     handrail
"""

from handrail.collect.lerobot.config_env import HandrailEnvConfig
from handrail.collect.lerobot.config_scripted import HandrailScriptedConfig
from handrail.collect.lerobot.config_sim import HandrailSimConfig
from handrail.collect.lerobot.scripted import HandrailScripted
from handrail.collect.lerobot.sim import HandrailSim

__all__ = [  # LeRobot looks for the classes here, by the names of their configs
    "HandrailEnvConfig",
    "HandrailScripted",
    "HandrailScriptedConfig",
    "HandrailSim",
    "HandrailSimConfig",
]
