"""The progress bar of a recording, with what the people who steer have to show above it."""

from collections.abc import Iterable, Sequence
from typing import Any

from rich.console import RenderableType
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.protocol import is_renderable

from handrail.datasets.presentation.terminal import Terminal


class _Progress(Progress):
    """The bar of a recording, below what the people who steer have to show."""

    def __init__(self, *columns: ProgressColumn, console: Terminal, shown: Sequence[Any]) -> None:
        self._shown = shown  # the bar draws itself once while it is made
        super().__init__(*columns, console=console)

    def get_renderables(self) -> Iterable[RenderableType]:
        """Return what is shown."""
        yield from self._shown
        yield from super().get_renderables()


def recording_bar(console: Terminal, people: Sequence[Any]) -> Progress:
    """Return the bar of a recording, not started.

    Args:
        console: to draw on.
        people: who steer now; what rich can draw of them is shown above the bar.
    """
    return _Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[success]}"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=console,
        shown=[each for each in people if is_renderable(each)],
    )
