"""`handrail-record`: record demonstrations as a LeRobot dataset."""

from handrail.collect.config import RecordConfig
from handrail.scripts import cli


def recorded(config: RecordConfig) -> int:
    """Record as configured; return the exit code."""
    config.check()
    from handrail.collect.commands.record import (
        record,  # loads the simulator: only once the settings are right
    )

    return record(config)


@cli.command("handrail-record", RecordConfig)
def main(config: RecordConfig) -> int:
    """Run the command."""
    return recorded(config)


if __name__ == "__main__":
    main()
