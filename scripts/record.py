"""`handrail-record`: record demonstrations as a LeRobot dataset."""

from handrail.collect.config import RecordConfig
from handrail.collect.execution.forking import RECORDING, begin_loading
from handrail.collect.operators.catalogue import OPERATORS
from handrail.scripts import cli


def recorded(config: RecordConfig) -> int:
    """Record as configured; return the exit code."""
    config.check()
    if OPERATORS.find(config.operator).interactive:
        cli.say_starting()
    if config.is_shared and not config.ray:
        begin_loading(RECORDING)  # the workers' modules, beside this process's own
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
