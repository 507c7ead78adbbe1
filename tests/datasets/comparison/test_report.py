"""What the report shows: what is better is right, nothing is hidden at an edge, no title covers another."""

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from compare_helpers import check_texts, evaluations
from figure_helpers import drawn_numbers, shows

from handrail.datasets.comparison.compare import compare
from handrail.datasets.comparison.config import CompareConfig
from handrail.datasets.comparison.figures import (
    answer_panels,
    draw_effect,
    effects_panels,
    metrics_panels,
    trajectory_panels,
    turned,
)
from handrail.datasets.comparison.groups import Group
from handrail.datasets.comparison.headline import headline
from handrail.datasets.comparison.page import dataset_report
from handrail.datasets.comparison.tables import collection_differences_table
from handrail.datasets.format.schema import Feature
from handrail.datasets.presentation.drawing import new_figure
from handrail.datasets.quality.catalogue import METRICS
from handrail.datasets.reading.demonstration import Demonstration
from handrail.datasets.reading.reader import DatasetInfo
from handrail.datasets.statistics.contrast import Contrast

LENGTH, DISTANCE = (next(m for m in METRICS if m.name == name) for name in ("length", "smallest_distance"))
LONG = ("a robot steered by the hand through the controller", "a robot steered joint by joint, unprotected")
JUDGED = re.compile(r"\b(better|worse|best|worst)\b")


pytestmark = pytest.mark.usefixtures("few_resamples")


@pytest.fixture(scope="module")
def alike(ours, few_resamples):
    return compare(CompareConfig(tuple(ours), labels=LONG))


@pytest.fixture(scope="module")
def page(alike):
    return dataset_report(alike).html


@pytest.fixture(scope="module")
def unlike(ours, few_resamples):
    """The same comparison, but the second dataset is another task of another robot."""
    found = compare(CompareConfig(tuple(ours)))
    views = [
        replace(view, groups=_another(view.groups), collected=_another(view.collected))
        for view in found.views
    ]
    return replace(found, views=views)


def _another(groups):
    one, other = groups
    episodes = tuple(replace(e, meta={**e.meta, "tasks": ["stay"]}) for e in other.episodes)
    return [one, replace(other, info=replace(other.info, robot_type="other"), episodes=episodes)]


def contrast(metric, estimate, low, high, spread=1.0, **more):
    names = {"measure": metric, "label": "a", "baseline": "b"}
    return Contrast(**names, estimate=estimate, interval=(low, high), spread=spread, **more)


def drawn(metric, estimate, low, high, spread=1.0, sign=1.0):
    """Return the markers of a difference, left to right, with where each stands."""
    axes = new_figure(4.0, 1.0).subplots()
    each = contrast(metric, estimate, low, high, spread, p_adjusted=0.001)
    draw_effect(axes, each, 0.0, "#000000", sign)
    marks = [(line.get_marker(), line.get_xdata()) for line in axes.lines if line.get_marker() != "None"]
    return sorted((float(np.ravel(x)[0]), mark) for mark, x in marks)


def test_a_difference_without_spread_is_an_arrow_and_not_at_zero():
    """Every episode of one group has 5 and of the other 2: infinitely many standard deviations."""
    each = contrast(LENGTH, 3.0, 3.0, 3.0, 0.0)
    assert each.effect == (np.inf, np.inf, np.inf)
    assert {mark for _, mark in drawn(LENGTH, 3.0, 3.0, 3.0, spread=0.0)} == {">"}
    assert {mark for _, mark in drawn(LENGTH, -3.0, -3.0, -3.0, spread=0.0)} == {"<"}
    assert {place for place, _ in drawn(LENGTH, 0.1, 0.1, 0.1, spread=1e-17)} == {4.0}
    assert drawn(LENGTH, 0.0, 0.0, 0.0, spread=0.0) == [(0.0, "o")]


def test_intervals_that_are_cut_carry_arrows():
    assert drawn(DISTANCE, 3.0, 1.0, 9.0) == [(3.0, "o"), (4.0, ">")]
    assert drawn(DISTANCE, 0.0, -9.0, 9.0) == [(-4.0, "<"), (0.0, "o"), (4.0, ">")]
    assert drawn(DISTANCE, 3.0, 2.0, 4.0) == [(3.0, "o")]
    assert [mark for _, mark in drawn(DISTANCE, -7.0, -9.0, -5.0)] == ["<"] * 3


def test_right_is_better():
    assert drawn(LENGTH, 3.0, 1.0, 9.0, sign=-1.0) == [(-4.0, "<"), (-3.0, "o")]
    assert (turned(LENGTH, True), turned(DISTANCE, True), turned(LENGTH, False)) == (True, False, False)


def test_figures_show_what_was_measured(alike):
    everything = alike.everything
    (first, _) = answer_panels(alike)
    assert shows(
        first.figure, [100 * group.successes / len(group.episodes) for group in everything.collected]
    )
    for panel, metric in zip(metrics_panels(alike), shown_metrics(alike), strict=True):
        for found in everything.measurements.values[metric].values():
            if found.known.size:
                assert shows(panel.figure, [found.estimate, *found.known])
    tested = [each for each in everything.differences if each.interval]
    near = [abs(each.effect[0]) for each in tested if abs(each.effect[0]) < 4.0]
    pictures = np.abs(np.concatenate([drawn_numbers(panel.figure) for panel in effects_panels(alike)]))
    assert near
    assert all(np.isclose(pictures, value).any() for value in near)


def shown_metrics(comparison):
    values = comparison.everything.measurements.values
    names = dict.fromkeys(each.measure.name for each in comparison.everything.differences)
    return [name for name in names if any(found.known.size for found in values[name].values())]


def test_metrics_are_turned_so_that_right_is_better(alike):
    (judged,) = effects_panels(alike)
    assert judged.title == f"Right is better than {LONG[0]}, left is worse"
    names = [label.get_text() for label in judged.figure.axes[0].get_yticklabels()]
    assert "episode length ↓" in names
    assert "path efficiency" in names
    for panel in metrics_panels(alike):
        (axes,) = panel.figure.axes
        assert axes.xaxis_inverted() == ("↓" in panel.title)
    turned_round = {panel.title.split(" ↓")[0] for panel in metrics_panels(alike) if "↓" in panel.title}
    applied = {
        m.title for m in METRICS if alike.everything.measurements.values[m.name][LONG[0]].estimate is not None
    }
    assert turned_round == applied & {metric.title for metric in METRICS if metric.good == "lower"}


def test_metrics_without_a_better_direction_stand_apart(alike):
    ratio = next(metric for metric in METRICS if metric.name == "variation_ratio")
    each = replace(contrast(ratio, 1.0, 0.5, 1.5), label=LONG[1], baseline=LONG[0])
    view = replace(alike.everything, differences=[*alike.everything.differences, each])
    judged, rest = effects_panels(replace(alike, views=[view, *alike.views[1:]]))
    rows = [[label.get_text() for label in each.figure.axes[0].get_yticklabels()] for each in (judged, rest)]
    assert rows[1] == [ratio.title]
    assert ratio.title not in rows[0]
    assert rest.title.endswith("neither counts as good")


def test_no_text_covers_another(alike):
    """Titles stand beside the figures, where the page breaks lines; within, nothing touches or is cut."""
    panels = [
        *answer_panels(alike), *effects_panels(alike), *metrics_panels(alike), *trajectory_panels(alike)
    ]  # fmt: skip
    for panel in panels:
        assert not any(axes.get_title() for axes in panel.figure.axes)
        check_texts(panel.figure)


def test_the_headline_has_the_numbers_of_the_tables(ours):
    for base, other, share, rate in (("quick", "slow", -50, 0.2), ("slow", "quick", 50, 5.0)):
        comparison = compare(CompareConfig(tuple(ours), baseline=base))
        said = headline(comparison)
        success, hourly = said.split(". ")
        assert success.startswith("Success while collecting: ")
        (_, name, difference, interval, *_), (_, _, ratio, ratios, *_) = collection_differences_table(
            comparison
        ).rows
        assert (name, str(difference)) == (f"{other} against {base}", f"{share:+d} points".replace("-", "−"))
        assert f"{difference} (95 % {interval})" in success
        assert f"{ratio} (95 % {ratios})" in hourly
        for cell, said in ((difference, success), (ratio, hourly)):
            assert getattr(cell, "look", "") == ("detected" if ", a difference detected" in said else "")
        low, high = comparison.collecting[1].interval or (np.nan, np.nan)
        assert low < rate < high


def test_where_tasks_or_robots_differ_that_comes_first_and_nothing_is_better(unlike, page):
    first = headline(unlike)
    assert first.startswith("The tasks and the robots differ: ")
    said = re.sub(r"<style>.*?</style>|data:[^\"]*", "", dataset_report(unlike).html)
    assert said.index(first) < said.index("<h2>")
    assert not JUDGED.search(said), JUDGED.findall(said)
    assert JUDGED.search(page)
    (panel,) = effects_panels(unlike)
    assert panel.title.startswith("Right is more than quick, left is less")
    assert not any(axes.xaxis_inverted() for panel in metrics_panels(unlike) for axes in panel.figure.axes)


def test_policies_of_unlike_tasks_do_not_come_before_that(ours, unlike, tmp_path):
    given = evaluations(tmp_path / "e.json", 4, quick=0.95, slow=0.3)
    outcomes = compare(CompareConfig(tuple(ours), evaluations=(given,))).outcomes
    assert headline(replace(unlike, outcomes=outcomes)) == headline(unlike)


@pytest.mark.parametrize("spoilt", [0, 1, 2])
def test_an_episode_whose_motion_is_not_known_has_no_path(spoilt):
    features = {"observation.state": Feature("float64", (2,), ("x", "y"))}
    info = DatasetInfo(Path("one"), 20, "arm", features, 3, 30, "", "", from_handrail=False)
    ways = [np.outer(np.arange(10.0), [1.0, number]) for number in range(3)]
    ways[spoilt][4] = np.nan
    meta = {"length": 10, "tasks": ["go"]}
    episodes = [Demonstration(n, info, {"observation.state": way}, meta) for n, way in enumerate(ways)]
    groups = [Group("a", info, tuple(episodes)), Group("none", info, (episodes[spoilt],))]
    colours = dict.fromkeys(("a", "none"), "red")
    (panel,) = trajectory_panels(SimpleNamespace(everything=SimpleNamespace(groups=groups), colours=colours))
    assert len(panel.figure.axes[0].lines) == 2 * 2  # a path, and a dot at its end
