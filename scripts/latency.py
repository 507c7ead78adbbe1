"""`handrail-latency`: measure how soon the robot does what a page of the cockpit asks."""

from pathlib import Path

from handrail.collect.experiments.latency.config import LatencyConfig
from handrail.scripts import cli


@cli.command("handrail-latency", LatencyConfig)
def main(config: LatencyConfig) -> int:
    """Run the command."""
    config.check()
    from handrail.collect.experiments.latency.measure import measure
    from handrail.collect.experiments.latency.table import latency_table, write_page
    from handrail.datasets.presentation.terminal import Terminal
    from handrail.datasets.storage.strict_json import write_json

    results = measure(config)
    if config.json:
        write_json(Path(config.json).expanduser(), results)
    if config.page:
        write_page(results, config)
    Terminal().print(latency_table(results))
    return 0


if __name__ == "__main__":
    main()
