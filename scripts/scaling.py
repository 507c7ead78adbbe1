"""`handrail-scaling`: measure how many episodes a second several workers record, against one."""

from pathlib import Path

from handrail.collect.experiments.scaling.config import ScalingConfig
from handrail.scripts import cli


@cli.command("handrail-scaling", ScalingConfig)
def main(config: ScalingConfig) -> int:
    """Run the command."""
    config.check()
    from handrail.collect.experiments.scaling.scaling import measure, scaling_table
    from handrail.datasets.presentation.terminal import Terminal
    from handrail.datasets.storage.strict_json import write_json

    results = measure(config)
    if config.json:
        write_json(Path(config.json).expanduser(), results)
    Terminal().print(scaling_table(results))
    return 0 if len({run["rows"] for run in results["runs"]}) == 1 else cli.FAILED


if __name__ == "__main__":
    main()
