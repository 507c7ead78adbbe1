"""Tables that the commands print."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from handrail.datasets.presentation.table import Table
from handrail.datasets.presentation.wording import DASH, number, yes_no
from handrail.datasets.quality.measure import measure
from handrail.datasets.quality.metric import Metric
from handrail.datasets.quality.summary import CHATTERING, summarize
from handrail.datasets.quality.takeover import TAKE_OVER
from handrail.datasets.quality.worst import Ranked
from handrail.datasets.reading.load import recorded_episodes
from handrail.datasets.recording.frames import INTERVENTION

_QUALITY = ("episode", "mode", "length [s]", "smoothness")


def summary_table(root: Path) -> Table:
    """Return a table with one line an episode of any LeRobot v3.0 dataset."""
    rows = summarize(root)
    known = [row.success for row in rows if row.success is not None]
    caption = f"{len(rows)} episodes" + (f", {sum(known)} succeeded" if known else "")
    clients = sorted({row.robot_client for row in rows if row.robot_client})
    caption += f"; driven through the client of {', '.join(clients)}" if clients else ""
    tasks = {row.task for row in rows}
    left_out = (*CHATTERING, *(("task",) if len(tasks) == 1 else ()))
    title = f"{root}: {tasks.pop()}" if len(tasks) == 1 else str(root)
    lines = [{name: cell for name, cell in row.cells().items() if name not in left_out} for row in rows]
    headings = list(lines[0]) if lines else ["episode"]
    return Table(headings, [list(line.values()) for line in lines], title, caption)


def quality_table(root: Path) -> Table:
    """Return a table with the measures of quality of every episode of any LeRobot v3.0 dataset."""
    caption = (
        "rate of change and high-frequency content of the commanded velocities; "
        "corrections of joints that were commanded one by one, switched on or off"
    )
    rows = [row.cells() for row in summarize(root)]
    hands = [name for name in rows[0] if name.startswith("smoothness,")] if rows else []
    headings = (*_QUALITY, *hands, *CHATTERING)
    return Table(headings, [[row[name] for name in headings] for row in rows], caption=caption)


def takeover_table(root: Path) -> Table | None:
    """Return a table of how often, for how long and what a person took over; None where no policy drove."""
    episodes = recorded_episodes(root)
    if not episodes or INTERVENTION not in episodes[0].info.features:
        return None
    found = measure({"": episodes}, np.random.default_rng(0), metrics=TAKE_OVER).values
    rows = [
        [str(episode.number), *(number(found[each.name][""].values[place]) for each in TAKE_OVER)]
        for place, episode in enumerate(episodes)
    ]
    means = ["mean", *(number(found[each.name][""].estimate) for each in TAKE_OVER)]
    return Table(("episode", *(each.heading for each in TAKE_OVER)), [*rows, means])


def worst_table(root: Path, metric: Metric, worst: Sequence[Ranked]) -> Table:
    """Return a table of the worst episodes, the worst first."""
    rows = [
        [
            str(each.episode.number),
            number(each.value),
            yes_no(each.episode.success),
            str(each.episode.meta.get("failure_reason") or DASH),
            f"{each.episode.seconds:.1f}",
        ]
        for each in worst
    ]
    caption = f"{metric.meaning}; {metric.good} is better"
    return Table(("episode", metric.heading, "success", "why not", "length [s]"), rows, str(root), caption)
