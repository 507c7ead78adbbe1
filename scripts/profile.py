"""`handrail-profile`: time the controller's update against IPOPT and mink."""

from handrail.collect.experiments.profiling.config import ProfileConfig
from handrail.scripts import cli


@cli.command("handrail-profile", ProfileConfig)
def main(config: ProfileConfig) -> int:
    """Run the command."""
    config.check()
    from rich.console import Console

    from handrail.collect.experiments.profiling.profiling import Profile, save
    from handrail.collect.experiments.profiling.tables import profile_tables

    results = Profile(config).run()
    if config.json:
        save(results, config.json)
    Console().print(profile_tables(results))
    return 0


if __name__ == "__main__":
    main()
