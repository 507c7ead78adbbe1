"""The report of a comparison of datasets: the answer first, then how it came about."""

import io
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import Any

from handrail.controllers.regular_file import regular
from handrail.datasets.comparison import figures, tables
from handrail.datasets.comparison.collection import HOURLY, SUCCESS
from handrail.datasets.comparison.compare import Comparison
from handrail.datasets.comparison.groups import Group, group_of
from handrail.datasets.comparison.headline import cautions, headline
from handrail.datasets.comparison.policies import Outcomes
from handrail.datasets.comparison.report import Report, contrast_table
from handrail.datasets.format.schema import video_keys
from handrail.datasets.presentation import markup
from handrail.datasets.presentation.drawing import Panel, address, svg
from handrail.datasets.presentation.table import Table
from handrail.datasets.presentation.wording import DASH, duration, number, percent, percent_span, span
from handrail.datasets.reading.demonstration import Episode
from handrail.datasets.reading.digest import video_of

FORMAT = "handrail.comparison/4"
_SHOWN = 3  # episodes of a group whose first pictures are shown
_WIDTH = 240  # of a picture [px]
_REST = "The report has every metric, also where no difference was detected: that does not mean equal."
_HOW = (
    "Every interval is 95 %. Shares: Wilson; their differences: Newcombe's method 10, exact McNemar test"
    " where the same seeds were tried under both, Boschloo's where not (Fisher's beyond 500 each). Several"
    " policies in the same scenes: “these policies” takes the scene for the unit; “with training” is the"
    " wider of a nested bootstrap over dataset draw, training seed and evaluation seed and of Student's t"
    " over the policies (over draws where there are several), and Welch's t test has to agree. Means of"
    " metrics: bootstrap over episodes and permutation tests (of Welch's t, or paired by seed where every"
    " episode has one that began alike). A metric whose unit is the dataset depends on the number of"
    " episodes: it is described at the same number, not tested. Detected: the intervals leave zero out, p"
    " stays below 0.05 after Holm's correction over its family. “Not detected” does not mean “equal”:"
    " “detectable” is the difference that 80 % of such experiments detect. “Same number” and “same time” are"
    " of the first episodes of each group; where persons took turns, the last of them may be missing. ↔:"
    " follows the length of the episodes (Spearman's |ρ| ≥ 0.5); “same length” has that taken off by"
    " analysis of covariance."
)
_EFFECTS = "Filled: detected; hollow: not. An arrow: beyond the frame, or a difference where nothing varies."
_SLOWEST = (
    "The three of each group at the wrong end of each metric, and the command that writes the dataset without"
    " them. The slowest episode may be the one with the hardest scene: look before you leave it out."
)


def dataset_report(comparison: Comparison) -> Report:
    """Return the report of a comparison of datasets."""
    outcomes, view = comparison.outcomes, comparison.everything
    detected = [each for each in view.differences if each.detected]
    policies = tables.policy_tables(outcomes) if outcomes else []
    collecting = [tables.collection_table(view), tables.collection_differences_table(comparison)]
    told = contrast_table(detected, ("measure", "group", "difference", "95 %", "p, Holm"), caption=_REST)
    *others, last = comparison.labels
    names, tasks = {group.info.root.name for group in view.groups}, {t for g in view.groups for t in g.tasks}
    missing = tables.missing_table(comparison)
    return Report(
        title=f"{', '.join(others)} and {last}, compared",
        what=f"{', '.join(sorted(names))} – {tables.shown_tasks(sorted(tasks))}",
        headline=headline(comparison),
        limits=cautions(comparison),
        tables=[*policies, *collecting, told],
        first=[
            markup.cards(_card(comparison, group) for group in view.collected),
            markup.section("", _legend(comparison), _drawn(figures.answer_panels(comparison))),
        ],
        sections=[
            ("Policies", policies),
            ("Collected data", collecting),
            ("Quality", _quality(comparison)),
            ("Trajectories", [_drawn(figures.trajectory_panels(comparison)), _pictures(comparison)]),
            ("Episodes to look at first", [markup.paragraph(_SLOWEST, "quiet"), *_worst(comparison)]),
            ("Not applicable, or not comparable", [missing] if missing.rows else []),
        ],
        how=_HOW,
        values=comparison.values,
        contrasts=comparison.contrasts,
        content={
            "format": FORMAT,
            "baseline": comparison.baseline,
            "unlike": comparison.unlike,
            "config": asdict(comparison.config),
            "conditions": {
                view.title: {group.label: group.content for group in view.collected}
                for view in comparison.views
            },
            "policies": [each.content for each in outcomes.conditions.values()] if outcomes else [],
        },
        units={"episodes.csv": _episode_rows(comparison)},
    )


def _episode_rows(comparison: Comparison) -> list[dict[str, Any]]:
    """Return a row an episode: which, how it ended, every metric; NaN where one does not apply."""
    view, rows = comparison.everything, []
    for group in view.groups:
        for place, each in enumerate(group.episodes):
            row = {"group": group.label, "dataset": group.info.root.name, "episode": each.number}
            values = view.measurements.values.items()
            metrics = {name: groups[group.label].values[place] for name, groups in values}
            rows.append(row | {"success": each.success} | metrics)
    return rows


def _drawn(found: Iterable[Panel], look: str = "") -> str:
    return markup.panels([(panel.title, panel.note, svg(panel.figure)) for panel in found], look)


def _legend(comparison: Comparison) -> str:
    return markup.legend((label, comparison.colours[label]) for label in comparison.labels)


def _card(comparison: Comparison, group: Group) -> str:
    """Return a group's card: success of its policies if there are any, else in collection."""
    found = {each.measure: each for each in comparison.everything.collecting if each.label == group.label}
    success, hourly = found[SUCCESS], found[HOURLY]
    count = f"{len(group.episodes)} episodes"
    rate = number(hourly.estimate) + (f" ({span(hourly.interval)})" if hourly.interval else "")
    big, first, known = count, [], not success.reason
    if comparison.outcomes:
        big, told = _of_policies(comparison.outcomes, group.label, comparison.labels)
        first = [told, *([f"collecting: {percent(success.estimate)}"] if known else [])]
    elif known:
        big = percent(success.estimate)
        first = [f"succeeded while collecting, {percent_span(success.interval)} (95 %)"]
    lines = [
        *first,
        f"{count} in {duration(group.seconds)} of operator time",
        f"{rate} successes per operator hour" if known else success.reason,
    ]
    return markup.card(group.label, comparison.colours[group.label], big, lines)


def _of_policies(outcomes: Outcomes, label: str, labels: Sequence[str]) -> tuple[str, str]:
    """Return the success of a group's policies and what it is of: of the group's own name first."""
    mine = [each for each in outcomes.successes.values() if group_of(each.label, labels) == label]
    if not mine:
        return DASH, "no policy was evaluated"
    value = min(mine, key=lambda each: each.label != label)
    whose = "" if value.label == label else f" of {value.label}"
    return percent(value.estimate), f"policy success{whose}, {percent_span(value.widest)} (95 %)"


def _quality(comparison: Comparison) -> list[str | Table]:
    turned = "" if comparison.unlike else f" {figures.TURNED}: less is better, so the metric is turned round."
    rows = [
        [view.title, *(str(len(group.episodes)) for group in view.collected)] for view in comparison.views
    ]
    return [
        _legend(comparison),
        _drawn(figures.effects_panels(comparison), "wide"),
        markup.paragraph(_EFFECTS + turned, "quiet"),
        *(tables.metrics_table(comparison, label) for label in comparison.others),
        markup.paragraph("These numbers describe data; they do not rank it. Bold: detected.", "quiet"),
        Table(("", *comparison.labels), rows),
        _drawn(figures.metrics_panels(comparison), "small"),
    ]


def _pictures(comparison: Comparison) -> str:
    groups = comparison.everything.groups if comparison.config.pictures else ()
    found = [(group.label, markup.gallery(_first_pictures(group))) for group in groups]
    return "".join(markup.paragraph(label, "quiet") + pictures for label, pictures in found if pictures)


def _first_pictures(group: Group) -> list[tuple[str, str]]:
    """Return captions and pictures, as addresses that hold all of them; unreadable videos are left out."""
    found = {
        f"episode {episode.number}, {key.removeprefix('observation.images.')}": _first_picture(key, episode)
        for episode in group.episodes[:_SHOWN]
        for key in video_keys(group.info.features)
    }
    return [(caption, picture) for caption, picture in found.items() if picture]


def _first_picture(key: str, episode: Episode) -> str:
    import av
    from av.error import FFmpegError

    try:
        path, first = video_of(episode.info, episode.meta, key)
        begin = first / episode.fps
        with av.open(str(regular(path))) as container:
            container.seek(int(begin * 1_000_000))
            for frame in container.decode(container.streams.video[0]):
                if frame.time is None or frame.time >= begin - 0.5 / episode.fps:
                    picture, stream = frame.to_image(), io.BytesIO()
                    picture.thumbnail((_WIDTH, _WIDTH))
                    picture.save(stream, format="JPEG", quality=80)
                    return address(stream.getvalue(), "image/jpeg")
    except (OSError, FFmpegError, ValueError, TypeError, OverflowError, LookupError):
        return ""
    return ""


def _worst(comparison: Comparison) -> list[str]:
    return [
        markup.folded(group.label, markup.table(tables.worst_table(comparison, group)))
        for group in comparison.everything.groups
    ]
