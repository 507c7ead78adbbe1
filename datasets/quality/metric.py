"""A quality metric: its name, unit and meaning, what its unit hangs on, and how it is measured."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Literal

from handrail.datasets.statistics.contrast import Measure

Needs = Literal["", "motion", "jerk", "position", "action", "controller", "scale"]


@dataclass(frozen=True, kw_only=True)
class Metric(Measure):
    """A measure of recorded data; its unit is an episode, or a whole dataset."""

    measure: Callable[..., Any]
    """Of an episode `(Demonstration, Scale) -> float`; of a dataset `(EpisodeSet, rng) -> (N,)` frames."""
    needs: Needs = ""
    """The columns that its unit depends on, see `units.why_not`: "" for none."""
    of_dataset: bool = False
    """Whether an episode's value depends on the others, on their number and on neighbours that they share."""

    @property
    def is_of_motion(self) -> bool:
        """Whether it measures what moves; of several hands, that is each of them."""
        return self.needs in ("motion", "jerk", "position")

    def of_hand(self, hand: str) -> "Metric":
        """Return the metric of one hand alone of several."""

        def measured(episode: Any, scale: Any) -> float:
            return self.measure(episode.of_hand(hand), scale)

        return replace(self, name=f"{hand}.{self.name}", title=f"{self.title}, {hand}", measure=measured)


def metric(
    unit: str = "", good: str = "", needs: Needs = "", title: str = "", of_dataset: bool = False
) -> Callable[[Callable[..., Any]], Metric]:
    """Return what makes a metric of the function that measures it.

    Its name is the function's, its meaning the docstring's first line, its title the name if not given.
    """

    def made(measure: Callable[..., Any]) -> Metric:
        name, meaning = measure.__name__, (measure.__doc__ or "").partition("\n")[0].rstrip(".")
        return Metric(
            name=name,
            title=title or name.replace("_", " "),
            unit=unit,
            good=good,
            meaning=meaning[:1].lower() + meaning[1:],
            measure=measure,
            needs=needs,
            of_dataset=of_dataset,
        )

    return made
