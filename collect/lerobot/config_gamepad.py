"""Settings of the teleoperator `handrail_gamepad`."""

from dataclasses import dataclass

from lerobot.teleoperators import TeleoperatorConfig

from handrail.collect.teleop_config import TeleopConfig


@TeleoperatorConfig.register_subclass("handrail_gamepad")
@dataclass(kw_only=True)
class HandrailGamepadConfig(TeleoperatorConfig):
    """A person with a gamepad steers `handrail_sim`. The names are those of `--teleop` of `handrail-record`.

    Attributes:
        map: file (.toml) that gives controls another meaning.
        dead_zone: deflection of a stick that counts as none, 0 to 0.5.
        exponent: curve of a stick, 1 (straight) to 3 (fine near the middle).
    """

    map: str = ""
    dead_zone: float = TeleopConfig.dead_zone
    exponent: float = TeleopConfig.exponent

    def teleop(self) -> TeleopConfig:
        """Return the settings of the device."""
        config = TeleopConfig(map=self.map, dead_zone=self.dead_zone, exponent=self.exponent)
        config.check("gamepad")
        return config
