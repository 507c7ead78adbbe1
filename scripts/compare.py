"""`handrail-compare`: compare datasets, or teleop modes in one, and write a report."""

from typing import TYPE_CHECKING

from handrail.datasets.comparison.config import CompareConfig
from handrail.scripts import cli

if TYPE_CHECKING:
    from handrail.datasets.presentation.terminal import Terminal


@cli.command("handrail-compare", CompareConfig)
def main(config: CompareConfig) -> int:
    """Run the command."""
    config.check()
    from handrail.datasets.presentation.terminal import Terminal

    console = Terminal()
    if config.study:
        return _people(config, console)
    from handrail.datasets.comparison.cautions import cautions
    from handrail.datasets.comparison.compare import compare
    from handrail.datasets.comparison.headline import headline
    from handrail.datasets.comparison.report.report import write_report
    from handrail.datasets.comparison.report.tables import answer_tables

    comparison = compare(config)
    files = write_report(comparison)
    console.print(headline(comparison))
    console.print()
    for table in answer_tables(comparison):
        console.print(table)
    for text in cautions(comparison):
        console.print(f"! {text}")
    console.print()
    console.print("Written: " + ", ".join(map(str, files)))
    return 0


def _people(config: CompareConfig, console: "Terminal") -> int:
    from handrail.datasets.comparison.people.people import compare_people
    from handrail.datasets.comparison.people.report import write_people_report
    from handrail.datasets.comparison.people.tables import people_tables

    comparison = compare_people(config)
    for table in people_tables(comparison):
        console.print(table)
    for text in comparison.cautions:
        console.print(f"! {text}")
    files = write_people_report(comparison)
    console.print()
    console.print("Written: " + ", ".join(map(str, files)))
    return 0


if __name__ == "__main__":
    main()
