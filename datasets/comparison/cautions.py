"""What a comparison leaves out, and what stands in the way of reading it as it is meant."""

from collections.abc import Iterator

from handrail.datasets.comparison.compare import Comparison
from handrail.datasets.comparison.outcomes import Outcomes

SEEDS = 3  # training seeds that are the least
_FEW = 20  # episodes


def unlike_caution(comparison: Comparison) -> str:
    """Return what is said before everything else where tasks or robots differ; "" where they do not."""
    if not comparison.unlike:
        return ""
    return (
        f"{'. '.join(comparison.unlike)}. What follows describes each and ranks nothing: a difference may be"
        " theirs alone."
    )


def cautions(comparison: Comparison) -> Iterator[str]:
    """Return what a reader has to know beside the findings."""
    groups = comparison.everything.groups
    if comparison.outcomes is None:
        yield (
            "No evaluations were given: nothing here says from which data policies learn more. Quality"
            " metrics describe data and have often misjudged that."
        )
    else:
        yield from training_cautions(comparison.outcomes)
    moving = [d for d in comparison.everything.differences if d.metric.needs in ("motion", "position")]
    if len({group.info.fps for group in groups}) > 1 and any(d.tested and not d.reason for d in moving):
        rates = ", ".join(f"{group.label} {group.info.fps} Hz" for group in groups)
        yield f"Frame rates differ ({rates}): smoothness and idle time are only roughly comparable."
    yield from _not_comparable(comparison)
    few = [group.label for group in groups if len(group.episodes) < _FEW]
    if few:
        yield f"Few episodes ({', '.join(few)}): intervals of means are rough below about {_FEW}."


def _not_comparable(comparison: Comparison) -> Iterator[str]:
    """Yield which metrics were not compared since their units are not known to be the same, and why."""
    told: dict[tuple[str, str], list[str]] = {}
    for each in comparison.everything.differences:
        if each.incomparable:
            told.setdefault((each.label, each.incomparable), []).append(each.metric.title)
    for (label, reason), titles in told.items():
        yield f"{label} and {comparison.baseline} are not compared in {', '.join(titles)}: {reason}."


def training_cautions(outcomes: Outcomes) -> Iterator[str]:
    """Return what the policies' intervals and tests leave out."""
    few = [condition.label for condition in outcomes.conditions if len(condition.seeds) < SEEDS]
    if few:
        yield (
            f"Fewer than {SEEDS} training seeds ({', '.join(few)}): the seed alone moves success by 10 to 15"
            " points, so the policies may differ where their data do not."
        )
    elif any(len(condition.seeds) < 5 for condition in outcomes.conditions):
        yield "Three or four training seeds say little of all trainings: only large differences are detected."
    if all(condition.draws == 1 for condition in outcomes.conditions):
        yield "One draw of each dataset: how much another recording would differ is not in the intervals."
    if any(not difference.rollouts.paired for difference in outcomes.differences):
        yield "Training or evaluation seeds differ between conditions: rollouts were not compared as pairs."
    for name, title in (("episodes", "numbers of episodes"), ("operator_time", "operator times")):
        values = {
            condition.trained_on[name] for condition in outcomes.conditions if name in condition.trained_on
        }
        if values and max(values) > 1.05 * min(values):
            yield f"The policies were trained on different {title}, which alone can make them differ."
