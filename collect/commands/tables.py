"""Tables that the commands print."""

from pathlib import Path

from handrail.datasets.presentation.table import Table
from handrail.datasets.quality.summary import HEADINGS, QUALITY_HEADINGS, summarize

_TASK = HEADINGS.index("task")


def summary_table(root: Path) -> Table:
    """Return a table with one line an episode of any LeRobot v3.0 dataset.

    Raises:
        HandrailError: there is no dataset, or it cannot be read.
    """
    rows = summarize(root)
    known = [row.success for row in rows if row.success is not None]
    caption = f"{len(rows)} episodes" + (f", {sum(known)} succeeded" if known else "")
    tasks = {row.task for row in rows}
    shown = [index for index in range(len(HEADINGS)) if index != _TASK or len(tasks) > 1]
    title = f"{root}\n{tasks.pop()}" if len(tasks) == 1 else str(root)
    lines = [[row.cells()[index] for index in shown] for row in rows]
    return Table([HEADINGS[index] for index in shown], lines, title, caption)


def quality_table(root: Path) -> Table:
    """Return a table with the measures of quality of every episode of any LeRobot v3.0 dataset.

    Raises:
        HandrailError: there is no dataset, or it cannot be read.
    """
    caption = (
        "rate of change and high-frequency content of the commanded velocities;\n"
        "corrections of joints that were commanded one by one, switched on or off"
    )
    return Table(QUALITY_HEADINGS, [row.quality_cells() for row in summarize(root)], caption=caption)
