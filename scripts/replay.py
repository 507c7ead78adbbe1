"""`handrail-replay`: run a recorded episode's commands again and report the deviation."""

from pathlib import Path

from handrail.collect.config import ReplayConfig
from handrail.scripts import cli

_PICTURES = 8


def main() -> None:
    """Run the command."""
    cli.run(lambda: _replay(cli.parse(ReplayConfig, "handrail-replay")))


def _replay(config: ReplayConfig) -> int:
    config.check()
    from rich.console import Console
    from rich.table import Table

    from handrail.collect.contact_sheet import save_sheet
    from handrail.collect.replay import replay_episode
    from handrail.datasets.reader import read_episodes

    root = config.dataset.folder
    episodes = range(len(read_episodes(root))) if config.episode < 0 else [config.episode]
    headings = ("largest deviation", "of", "tool at end [m]", "success", "recorded", "contacts begun")
    table = Table("episode", *headings)
    for episode in episodes:
        replay, pictures = replay_episode(root, episode, _PICTURES if config.sheet else 0)
        table.add_row(
            str(episode),
            f"{replay.largest:.2e}",
            replay.names[int(replay.deviations.argmax())],
            f"{replay.tool_at_end:.2e}",
            "yes" if replay.success else "no",
            "yes" if replay.recorded_success else "no",
            str(replay.contacts),
        )
        if pictures:
            save_sheet(pictures, Path(config.sheet).expanduser())
    Console().print(table)
    return 0


if __name__ == "__main__":
    main()
