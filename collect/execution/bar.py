"""The progress bar of whatever takes long."""

from collections.abc import Iterable, Sequence
from typing import Any

from rich.console import RenderableType
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.protocol import is_renderable

from handrail.datasets.presentation.terminal import Terminal


class WorkBar(Progress):
    """How much of the work is done, in words too, and how long it takes; a context that shows it.

    Args:
        console: to draw on.
        title: what is done.
        total: how much there is to do.
        above: what rich can draw of these is shown above the bar.
    """

    def __init__(
        self, console: Terminal, title: str, total: int | None = None, above: Sequence[Any] = ()
    ) -> None:
        self._above = [each for each in above if is_renderable(each)]  # the bar draws itself while it is made
        super().__init__(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[words]}", markup=False),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=console,
        )
        self._task = self.add_task(title, total=total, words="")

    def show(self, **changes: Any) -> None:
        """Show changes: `words`, `total`, `completed`, or by how much to `advance`."""
        self.update(self._task, **changes)

    def get_renderables(self) -> Iterable[RenderableType]:
        """Return what is shown."""
        yield from self._above
        yield from super().get_renderables()
