"""`handrail-inspect`: print a dataset's episodes as a table."""

from handrail.collect.config import InspectConfig
from handrail.scripts import cli


def main() -> None:
    """Run the command."""
    cli.run(lambda: _inspect(cli.parse(InspectConfig, "handrail-inspect")))


def _inspect(config: InspectConfig) -> int:
    from rich.console import Console

    from handrail.collect.tables import quality_table, summary_table
    from handrail.datasets.repair import repair

    console = Console()
    if config.repair:
        console.print(str(repair(config.dataset.folder)), highlight=False)
    console.print(summary_table(config.dataset.folder))
    if config.quality:
        console.print(quality_table(config.dataset.folder))
    return 0


if __name__ == "__main__":
    main()
