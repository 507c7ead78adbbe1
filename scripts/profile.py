"""`handrail-profile`: time the controller's update against IPOPT and mink."""

from pathlib import Path

from handrail.collect.experiments.profiling.config import ProfileConfig
from handrail.scripts import cli


@cli.command("handrail-profile", ProfileConfig)
def main(config: ProfileConfig) -> int:
    """Run the command."""
    config.check()
    from handrail.collect.experiments.profiling.profiling import profile
    from handrail.collect.experiments.profiling.tables import profile_tables
    from handrail.datasets.presentation.terminal import Terminal
    from handrail.datasets.storage.strict_json import write_json

    results = profile(config)
    if config.json:
        write_json(Path(config.json).expanduser(), results)
    Terminal().print(*profile_tables(results), sep="\n")
    return 0


if __name__ == "__main__":
    main()
