"""`handrail-demo`: record a few real demonstrations and show what came out."""

from handrail.collect.commands.config import DemoConfig
from handrail.scripts import cli


def main() -> None:
    """Run the command."""
    cli.run(lambda: _demo(cli.parse(DemoConfig, "handrail-demo")))


def _demo(config: DemoConfig) -> int:
    from handrail.collect.commands.demo import demo

    return demo(config)


if __name__ == "__main__":
    main()
