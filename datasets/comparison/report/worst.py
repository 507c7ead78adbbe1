"""The worst episodes of each group, metric by metric, with the command that leaves them out."""

from handrail.datasets.comparison.compare import Comparison
from handrail.datasets.comparison.groups import Group
from handrail.datasets.presentation.markup import folded, table
from handrail.datasets.presentation.table import Cell, Table
from handrail.datasets.presentation.wording import number
from handrail.datasets.quality.metric import Metric
from handrail.datasets.quality.worst import RANKING, deletion, ranked

_SHOWN = 3  # episodes of a group


def worst_folds(comparison: Comparison) -> str:
    """Return a table for each group that opens when asked for."""
    return "".join(
        folded(group.label, table(worst_table(comparison, group))) for group in comparison.everything.groups
    )


def worst_table(comparison: Comparison, group: Group) -> Table:
    """Return the worst episodes of a group by every metric of which one end is better."""
    rows = [row for metric in RANKING.values() if (row := _row(comparison, group, metric))]
    return Table(("metric", "episodes (value)", "without them"), rows)


def _row(comparison: Comparison, group: Group, metric: Metric) -> list[Cell | str]:
    values = comparison.everything.measurements.values[metric.name][group.label].values
    worst = ranked(group.episodes, metric, values)[:_SHOWN]
    if not worst or len({each.value for each in ranked(group.episodes, metric, values)}) < 2:
        return []  # nothing is worse than anything else
    said = ", ".join(f"{each.episode.number} ({number(each.value)})" for each in worst)
    unit = f" [{metric.unit}]" if metric.unit else ""
    return [
        Cell(metric.title + unit, "", metric.meaning),
        said,
        deletion(group.info, [each.episode.number for each in worst]),
    ]
