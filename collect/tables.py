"""Tables that the commands print."""

from pathlib import Path

from rich.table import Table

from handrail.datasets.summary import HEADINGS, summarize

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
    table = Table(*(HEADINGS[index] for index in shown), title=title, caption=caption)
    for row in rows:
        cells = row.cells()
        table.add_row(*(cells[index] for index in shown))
    return table
