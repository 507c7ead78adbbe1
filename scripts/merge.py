"""`handrail-merge`: write several datasets into one, in few large files."""

from handrail.datasets.editing.pack_config import MergeConfig
from handrail.scripts import cli


@cli.command("handrail-merge", MergeConfig)
def main(config: MergeConfig) -> None:
    """Run the command."""
    roots, target = config.roots, config.target
    from handrail.datasets.editing.pack import merge_datasets
    from handrail.datasets.presentation.terminal import Terminal

    Terminal().print(str(merge_datasets(roots, target, config.name, config.verify)))


if __name__ == "__main__":
    main()
