"""`handrail-fit-operator`: fit the scripted operator to recorded people."""

from handrail.collect.experiments.operator_fit.config import FitOperatorConfig
from handrail.scripts import cli


@cli.command("handrail-fit-operator", FitOperatorConfig)
def main(config: FitOperatorConfig) -> int:
    """Run the command."""
    config.check()
    from handrail.collect.experiments.operator_fit.run import run_fit
    from handrail.datasets.presentation.terminal import Terminal

    run_fit(config, Terminal())
    return 0


if __name__ == "__main__":
    main()
