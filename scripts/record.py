"""`handrail-record`: record demonstrations as a LeRobot dataset."""

from handrail.collect.config import RecordConfig
from handrail.scripts import cli


@cli.command("handrail-record", RecordConfig)
def main(config: RecordConfig) -> int:
    """Run the command."""
    config.check()
    from handrail.collect.commands.record import (
        record,  # loads the simulator: only once the settings are right
    )

    return record(config)


if __name__ == "__main__":
    main()
