"""`handrail-edit`: delete, keep, split, merge, trim, relabel and rename episodes, and keep every column."""

from handrail.datasets.editing.config import EditConfig
from handrail.scripts import cli


@cli.command("handrail-edit", EditConfig)
def main(config: EditConfig) -> None:
    """Run the command."""
    config.check()
    from handrail.datasets.editing.edit import edit
    from handrail.datasets.presentation.terminal import Terminal

    Terminal().print(*map(str, edit(config)), sep="\n")


if __name__ == "__main__":
    main()
