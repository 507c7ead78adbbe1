"""`handrail-record`: record demonstrations as a LeRobot dataset."""

from handrail.collect.config import RecordConfig
from handrail.scripts import cli


def main() -> None:
    """Run the command."""
    cli.run(lambda: _record(cli.parse(RecordConfig, "handrail-record")))


def _record(config: RecordConfig) -> int:
    config.check()
    from handrail.collect.commands.record import (
        record,  # loads the simulator: only once the settings are right
    )

    return record(config)


if __name__ == "__main__":
    main()
