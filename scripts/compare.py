"""`handrail-compare`: compare datasets, or teleop modes in one, and write a report."""

from handrail.datasets.comparison.config import CompareConfig
from handrail.scripts import cli


@cli.command("handrail-compare", CompareConfig)
def main(config: CompareConfig) -> int:
    """Run the command."""
    config.check()
    from rich.console import Console

    from handrail.datasets.comparison.compare import compare
    from handrail.datasets.comparison.findings import findings
    from handrail.datasets.comparison.report.report import write_report

    comparison = compare(config)
    files = write_report(comparison)
    console = Console(highlight=False, markup=False, soft_wrap=True)
    for finding in findings(comparison):
        console.print(
            f"{'!' if finding.kind == 'caution' else '●' if finding.detected else '·'} {finding.text}"
        )
    console.print("\nWritten: " + ", ".join(map(str, files)))
    return 0


if __name__ == "__main__":
    main()
