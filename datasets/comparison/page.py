"""The report as one page that needs nothing else: the answer first, then how it came about."""

import io
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from handrail.controllers.regular_file import regular
from handrail.datasets.comparison import tables
from handrail.datasets.comparison.collection import Collected
from handrail.datasets.comparison.compare import Comparison, EpisodeChoice
from handrail.datasets.comparison.figures import (
    TURNED,
    answer_panels,
    colours,
    effects_panels,
    metrics_panels,
    trajectory_panels,
)
from handrail.datasets.comparison.groups import Group, group_of
from handrail.datasets.comparison.headline import cautions, headline
from handrail.datasets.comparison.policies import Outcomes
from handrail.datasets.comparison.report import write_report
from handrail.datasets.format.info_file import fill
from handrail.datasets.format.schema import video_keys
from handrail.datasets.presentation.drawing import Panel, address, svg
from handrail.datasets.presentation.markup import (
    card,
    cards,
    folded,
    gallery,
    items,
    legend,
    page,
    panels,
    paragraph,
    section,
    table,
)
from handrail.datasets.presentation.table import Cell, Table
from handrail.datasets.presentation.wording import (
    DASH,
    duration,
    number,
    percent,
    percent_span,
    span,
)
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.quality.metric import Metric
from handrail.datasets.quality.worst import RANKING, deletion, ranked
from handrail.datasets.reading.episode import Episode
from handrail.datasets.reading.reader import DatasetInfo

FORMAT = "handrail.comparison/3"
_HOW = (
    "Every interval is 95 %. Shares: Wilson; their differences: Newcombe's method 10, exact McNemar test"
    " where the same seeds were tried under both, Boschloo's where not. Several trained policies that met the"
    " same scenes: “these policies” and these tests take the scene for the unit; “with training” is the wider"
    " of a nested bootstrap over dataset draw, training seed and evaluation seed and of Student's t over the"
    " policies (over draws where there are several), and Welch's t test over them has to agree."
    " Means of metrics: bootstrap over episodes and permutation tests, paired by seed where every episode has"
    " one that began alike. What needs all episodes of a group at once (action variance, state coverage,"
    " mutual information) depends on their number: it is described at the same number and not tested."
    " A difference counts as detected if its intervals leave zero out and p stays below 0.05 after"
    " Holm's correction over its family: success while collecting, successes an hour, all metrics that are"
    " tested in a view, or the policies' differences of one kind (mixed: their labels say that they differ in"
    " more than their data). “Not detected” does not mean “equal”: “detectable” is the difference that would"
    " be detected in 80 % of such experiments. ↔ marks metrics that follow the length of the episodes"
    " (Spearman's |ρ| ≥ 0.5); “same length” is the difference with that taken off by analysis of covariance."
)
_QUALITY = (
    "Each with its 95 % interval; bold: detected. These numbers describe data; they do not rank it. Point at"
    " a name for what it means, and at a dash for why there is nothing. “Same number” and “same time” are of"
    " the first episodes of each group, as many as the smallest has, or as fit into the shortest operator"
    " time: where persons took turns, the last of them may be missing."
)
_WORST = (
    "The three of each group at the wrong end of each metric, and the command that writes the dataset without"
    " them. The slowest episode may be the one with the hardest scene: look before you leave it out."
)
_EFFECTS = (
    "Filled: detected; hollow: not. An arrow: beyond what is shown, or a difference where nothing varies."
)
_TURNED = f" {TURNED}: less is better, so the metric is drawn the other way round."
_SHOWN = 3  # episodes of a group
_WIDTH = 240  # of a picture [pixels]


def _worst_episodes(comparison: Comparison, group: Group) -> str:
    """Return the worst episodes of a group by every metric of which one end is better, folded."""
    rows = [row for metric in RANKING.values() if (row := _row(comparison, group, metric))]
    return folded(group.label, table(Table(("metric", "episodes (value)", "without them"), rows)))


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


def _first_pictures(group: Group) -> list[tuple[str, str]]:
    """Return captions and pictures, as addresses that hold all of them; unreadable videos are left out."""
    shown = []
    for episode in group.episodes[:_SHOWN]:
        for key in video_keys(group.info.features):
            picture = _first_frame(group.info, key, episode)
            if picture:
                shown.append(
                    (f"episode {episode.number}, {key.removeprefix('observation.images.')}", picture)
                )
    return shown


def _first_frame(info: DatasetInfo, key: str, episode: Episode) -> str:
    import av
    from av.error import FFmpegError

    chunk, file = (episode.meta.get(f"videos/{key}/{name}") for name in ("chunk_index", "file_index"))
    if not (isinstance(chunk, int) and isinstance(file, int)):
        return ""
    try:
        begin = float(episode.meta.get(f"videos/{key}/from_timestamp") or 0.0)
        with av.open(str(regular(info.root / fill(info.video_path, chunk, file, key)))) as container:
            stream = container.streams.video[0]
            container.seek(int(begin * 1_000_000))
            for frame in container.decode(stream):
                if frame.time is None or frame.time >= begin - 0.5 / episode.fps:
                    return _address(frame)
    except (OSError, FFmpegError, ValueError, TypeError, OverflowError, IndexError):
        return ""
    return ""


def _address(frame: Any) -> str:
    picture = frame.to_image()
    picture.thumbnail((_WIDTH, _WIDTH))
    stream = io.BytesIO()
    picture.save(stream, format="JPEG", quality=80)
    return address(stream.getvalue(), "image/jpeg")


def write_comparison(comparison: Comparison) -> list[Path]:
    """Write the report into the folder of its config and return the files."""
    content = {
        "format": FORMAT,
        "baseline": comparison.baseline,
        "unlike": comparison.unlike,
        "config": asdict(comparison.config),
        "headline": headline(comparison),
        "cautions": cautions(comparison),
        "successes_an_hour": comparison.rates,
        "conditions": {view.title: _conditions(view) for view in comparison.views},
        "policies": list(map(asdict, comparison.outcomes.conditions)) if comparison.outcomes else [],
    }
    units = {"episodes.csv": _episode_rows(comparison)}
    page = report_page(comparison)
    return write_report(comparison.config.folder, page, content, comparison.contrasts, units)


def _conditions(view: EpisodeChoice) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for each in view.collected:
        metrics = {name: groups[each.label] for name, groups in view.measurements.values.items()}
        found[each.label] = asdict(each) | {
            "successes_an_hour": each.successes_an_hour,
            "metrics": {name: metric.content for name, metric in metrics.items()},
        }
    return found


def _episode_rows(comparison: Comparison) -> list[dict[str, Any]]:
    """Return a row an episode: which, how it ended, every metric; empty where one does not apply."""
    view, rows = comparison.everything, []
    values = view.measurements.values
    for group in view.groups:
        for place, episode in enumerate(group.episodes):
            row = {"group": group.label, "dataset": group.info.root.name, "episode": episode.number}
            row |= {"success": episode.success}
            rows.append(row | {m.name: values[m.name][group.label].values[place] for m in METRICS})
    return rows


def report_page(comparison: Comparison) -> str:
    """Return the page."""
    said = items(("caution", text) for text in cautions(comparison))
    parts = [*_first_screen(comparison), section("Read this first", said) if said else ""]
    if comparison.outcomes:
        differences = tables.outcome_differences_table(comparison.outcomes)
        parts.append(section("Policies", tables.conditions_table(comparison.outcomes), differences))
    parts += [
        section("What was collected", *_collected(comparison)),
        section("Quality", *_quality(comparison)),
        section("Trajectories", _drawn(trajectory_panels(comparison)), _pictures(comparison)),
    ]
    missing = tables.not_applicable_table(comparison)
    worst = [_worst_episodes(comparison, group) for group in comparison.everything.groups]
    parts.append(section("Episodes to look at first", paragraph(_WORST, "quiet"), *worst))
    parts += [section("What does not apply, or is not comparable", missing)] if missing else []
    meanings = items(("quiet", f"{metric.title}: {metric.meaning}.") for metric in METRICS)
    parts.append(section("How to read this", paragraph(_HOW), folded("What every metric means", meanings)))
    *first, last = comparison.labels
    return page(f"{', '.join(first)} and {last}, compared", *parts, what=_what(comparison))


def _drawn(shown: Iterable[Panel], look: str = "") -> str:
    return panels([(panel.title, panel.note, svg(panel.figure)) for panel in shown], look)


def _legend(comparison: Comparison) -> str:
    known = colours(comparison)
    return legend((label, known[label]) for label in comparison.labels)


def _collected(comparison: Comparison) -> list[Table]:
    return [tables.collection_table(comparison.everything), tables.collection_differences_table(comparison)]


def _what(comparison: Comparison) -> str:
    groups = comparison.everything.groups
    sources = sorted({group.info.root.name for group in groups})
    tasks = sorted({task for group in groups for task in group.tasks})
    return f"{', '.join(sources)} – {tables.shown_tasks(tasks)}"


def _first_screen(comparison: Comparison) -> list[str]:
    shown = [_card(comparison, each) for each in comparison.everything.collected]
    answer = paragraph(headline(comparison), "headline")
    figure = section("", _legend(comparison), _drawn(answer_panels(comparison)))
    return [answer, cards(shown), figure]


def _card(comparison: Comparison, each: Collected) -> str:
    rates, colour = comparison.rates[each.label], colours(comparison)[each.label]
    rate = number(each.successes_an_hour) + (f" ({span(rates)})" if rates else "")
    lines = [
        f"{each.episodes} episodes in {duration(each.operator_time)} of operator time",
        f"{rate} successes per operator hour" if each.successes is not None else "success was not recorded",
    ]
    if comparison.outcomes:
        collecting = [f"collecting: {percent(each.success)}"] if each.success is not None else []
        big, first = _policies(comparison.outcomes, each.label, comparison.labels)
        return card(each.label, colour, big, [first, *collecting, *lines])
    if each.successes is None:
        return card(each.label, colour, f"{each.episodes} episodes", lines)
    first = f"succeeded while collecting, {percent_span(each.success_interval)} (95 %)"
    return card(each.label, colour, percent(each.success), [first, *lines])


def _policies(outcomes: Outcomes, label: str, labels: Sequence[str]) -> tuple[str, str]:
    """Return what a card says of a group's policies, in large and below: of the group's own name first."""
    mine = [condition for condition in outcomes.conditions if group_of(condition.label, labels) == label]
    if not mine:
        return DASH, "no policy was evaluated"
    condition = min(mine, key=lambda condition: condition.label != label)
    whose = "" if condition.label == label else f" of {condition.label}"
    interval = percent_span(condition.nested or condition.wilson)
    return percent(condition.share), f"policy success{whose}, {interval} (95 %)"


def _quality(comparison: Comparison) -> list[str | Table]:
    turned = "" if comparison.unlike else _TURNED
    parts: list[str | Table] = [
        _legend(comparison),
        _drawn(effects_panels(comparison), "wide"),
        paragraph(_EFFECTS + turned, "quiet"),
    ]
    parts += [tables.metrics_table(comparison, label) for label in comparison.success]
    parts += [paragraph(_QUALITY, "quiet"), tables.views_table(comparison)]
    return [*parts, _drawn(metrics_panels(comparison), "small")]


def _pictures(comparison: Comparison) -> str:
    if not comparison.config.pictures:
        return ""
    shown = [(group.label, gallery(_first_pictures(group))) for group in comparison.everything.groups]
    return "".join(paragraph(label, "quiet") + pictures for label, pictures in shown if pictures)
