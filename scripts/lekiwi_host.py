"""`handrail-lekiwi-host`: simulate a LeKiwi on the network, in LeRobot's own protocol."""

from handrail.collect.lekiwi.host_config import HostConfig
from handrail.scripts import cli


@cli.command("handrail-lekiwi-host", HostConfig)
def main(config: HostConfig) -> int:
    """Run the command."""
    config.check()
    from handrail.collect.lekiwi.host import serve  # loads the simulator

    return serve(config)


if __name__ == "__main__":
    main()
