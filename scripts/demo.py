"""`handrail-demo`: record a few real demonstrations and show what came out."""

from handrail.collect.commands.config import DemoConfig
from handrail.scripts import cli


@cli.command("handrail-demo", DemoConfig)
def main(config: DemoConfig) -> int:
    """Run the command."""
    from handrail.collect.commands.demo import demo

    return demo(config)


if __name__ == "__main__":
    main()
