"""`handrail-cockpit`: drive a robot in a browser, and record demonstrations as a LeRobot dataset."""

from handrail.collect.config import DriveConfig
from handrail.scripts import cli
from handrail.scripts.record import recorded


@cli.command("handrail-cockpit", DriveConfig)
def main(config: DriveConfig) -> int:
    """Run the command."""
    return recorded(config)


if __name__ == "__main__":
    main()
