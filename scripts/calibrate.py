"""`handrail-calibrate`: say which joint of a leader arm drives which joint of a robot's arm."""

from handrail.collect.teleop_config import CalibrateConfig
from handrail.scripts import cli


@cli.command("handrail-calibrate", CalibrateConfig)
def main(config: CalibrateConfig) -> int:
    """Run the command."""
    config.check()
    from handrail.collect.devices.guided_calibration import calibrate

    return calibrate(config)


if __name__ == "__main__":
    main()
