"""`handrail-repair`: say what is wrong with a dataset, mend what can be mended, lose nothing."""

from handrail.collect.commands.config import RepairConfig
from handrail.scripts import cli


@cli.command("handrail-repair", RepairConfig)
def main(config: RepairConfig) -> int:
    """Return 0 only if everything that was saved is in the dataset and whole."""
    from handrail.datasets.presentation.terminal import Terminal
    from handrail.datasets.recording.repair import repair

    report = repair(config.dataset.folder, config.set_aside)
    Terminal().print(str(report))
    return 0 if report.complete else cli.FAILED


if __name__ == "__main__":
    main()
