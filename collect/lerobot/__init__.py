"""LeRobot's plugins: its own commands drive the simulated robots, and people and scripts steer through them.

`--robot.discover_packages_path=handrail.collect.lerobot` lets LeRobot find what is in `plugins`. The names of
`__all__` are imported from here, and LeRobot looks for its classes here, by the names of their configs.
LeRobot, and with it torch, is loaded when one of them is used.
"""

from typing import TYPE_CHECKING

from handrail.controllers.lazy import lazily

if TYPE_CHECKING:
    from handrail.collect.lerobot.config_env import HandrailEnvConfig as HandrailEnvConfig
    from handrail.collect.lerobot.configs import HandrailCockpitConfig as HandrailCockpitConfig
    from handrail.collect.lerobot.configs import HandrailGamepadConfig as HandrailGamepadConfig
    from handrail.collect.lerobot.configs import HandrailScriptedConfig as HandrailScriptedConfig
    from handrail.collect.lerobot.configs import HandrailSimConfig as HandrailSimConfig
    from handrail.collect.lerobot.person import HandrailCockpit as HandrailCockpit
    from handrail.collect.lerobot.person import HandrailGamepad as HandrailGamepad
    from handrail.collect.lerobot.scripted import HandrailScripted as HandrailScripted
    from handrail.collect.lerobot.sim import HandrailSim as HandrailSim

__all__, __getattr__ = lazily(__name__, __file__)  # pyright: ignore[reportUnsupportedDunderAll]
