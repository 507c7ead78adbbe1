"""`handrail-replay`: run a recorded episode's commands again and report the deviation."""

from pathlib import Path
from typing import TYPE_CHECKING

from handrail.collect.commands.config import ReplayConfig
from handrail.scripts import cli

if TYPE_CHECKING:
    from handrail.collect.commands.replay import Replay

_PICTURES = 8
_HEADINGS = ("episode", "largest deviation", "of", "tool at end [m]", "success", "recorded", "contacts begun")


@cli.command("handrail-replay", ReplayConfig)
def main(config: ReplayConfig) -> int:
    """Run the command."""
    config.check()
    from handrail.collect.commands.replay import replay_one_of
    from handrail.collect.session.film import save_sheet
    from handrail.datasets.presentation.table import Table
    from handrail.datasets.presentation.terminal import Terminal
    from handrail.datasets.reading.open_dataset import open_dataset

    rows, clients = [], set[str]()
    video = Path(config.video).expanduser() if config.video else None
    shown = _PICTURES if config.sheet else 0
    with open_dataset(config.dataset.folder) as dataset:
        for episode in range(len(dataset.rows)) if config.episode < 0 else [config.episode]:
            replay, pictures = replay_one_of(dataset, episode, shown, video, config.said)
            rows.append(_row(replay))
            clients.add(replay.robot_client)
            if pictures:
                save_sheet(pictures, Path(config.sheet).expanduser())
    console = Terminal()
    console.print(Table(_HEADINGS, rows))
    for client in sorted(filter(None, clients)):
        console.print(
            f"Recorded through the client of {client}: replayed here in simulation, so it deviates."
        )
    for written in filter(None, (config.sheet, config.video)):
        console.print(f"Written: {written}")
    return 0


def _row(replay: "Replay") -> tuple[str, ...]:
    return (
        str(replay.episode),
        f"{replay.largest:.2e}",
        replay.names[int(replay.deviations.argmax())],
        f"{replay.tool_at_end:.2e}",
        "yes" if replay.success else "no",
        "yes" if replay.recorded_success else "no",
        str(replay.contacts),
    )


if __name__ == "__main__":
    main()
