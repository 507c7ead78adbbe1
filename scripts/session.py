"""Commands in which a robot is driven; the simulator is loaded only once the settings are right."""

from pathlib import Path

from handrail.collect.commands.config import ReplayConfig
from handrail.collect.config import RecordConfig
from handrail.collect.execution.pool import RECORDING, begin_loading
from handrail.collect.operators.catalogue import OPERATORS
from handrail.collect.user_study.config import StudySessionConfig
from handrail.scripts import cli

_PICTURES = 8
_HEADINGS = ("episode", "largest deviation", "of", "tool at end [m]", "success", "recorded", "contacts begun")


def record(config: RecordConfig) -> int:
    """Record as configured; return the exit code."""
    if OPERATORS.find(config.operator).interactive:
        cli.say_starting()
    if config.is_shared and not config.ray:
        begin_loading(RECORDING)  # the workers' modules, beside this process's own
    from handrail.collect.commands import record

    return record.record(config)


def user_study(config: StudySessionConfig) -> int:
    """Lead people through a user study; return the exit code."""
    if config.verb == "run":
        cli.say_starting()
    from handrail.collect.user_study.run import study_session

    return study_session(config)


def replay(config: ReplayConfig) -> int:
    """Run a recorded episode's commands again and print the deviation; return the exit code."""
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
            rows.append(
                (
                    str(replay.episode),
                    f"{replay.largest:.2e}",
                    replay.names[int(replay.deviations.argmax())],
                    f"{replay.tool_at_end:.2e}",
                    "yes" if replay.success else "no",
                    "yes" if replay.recorded_success else "no",
                    str(replay.contacts),
                )
            )
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
