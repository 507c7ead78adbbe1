"""What `handrail-compare` compares: groups of episodes, matched in number and time, paired by their seeds."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from compare_helpers import evaluations, handrail_dataset
from datasets_helpers import create, frame_of

from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.collection import (
    collected,
    matched_number,
    matched_time,
    rate_ratio,
    shared_seeds,
)
from handrail.datasets.comparison.compare import compare
from handrail.datasets.comparison.config import CompareConfig
from handrail.datasets.comparison.evaluations import read_evaluations
from handrail.datasets.comparison.figures import answer_panels
from handrail.datasets.comparison.groups import load_groups
from handrail.datasets.comparison.headline import cautions
from handrail.datasets.comparison.page import dataset_report
from handrail.datasets.format.schema import Feature


def test_modes_of_one_dataset(tmp_path):
    root = tmp_path / "both"
    handrail_dataset(root, 100, "ee", 6)
    groups = load_groups([str(root), handrail_dataset(tmp_path / "other", 100, "joints", 6)], "mode")
    assert [group.label for group in groups] == ["both · ee", "other · joints"]
    with pytest.raises(HandrailError, match="expected 2 to 8 groups of episodes, got ee"):
        load_groups([str(root)], "mode")
    with pytest.raises(HandrailError, match=r"unknown column 'colour', expected one of .*mode"):
        load_groups([str(root)], "colour")


def test_a_mode_that_only_the_frames_know(tmp_path):
    features = {"action": Feature("float32", (2,)), "teleop.mode": Feature("string")}
    with create(tmp_path / "set", features=features) as writer:
        for mode in ("ee", "base", "ee"):
            for index in range(5):
                frame = {"action": frame_of(0, index, False)["action"], "teleop.mode": mode}
                writer.add_frame(frame, "go")
            writer.save_episode()
    groups = load_groups([tmp_path / "set"], "mode")
    assert {group.label: len(group.episodes) for group in groups} == {"ee": 2, "base": 1}


def test_matched_views(ours):
    quick, slow = load_groups(ours)
    short = replace(quick, episodes=quick.episodes[:5])
    assert [len(group.episodes) for group in matched_number([short, slow])] == [5, 5]
    matched = matched_time([quick, slow])
    budget = quick.seconds
    assert [group.seconds <= budget + 1e-9 for group in matched] == [True, True]
    assert matched[0] == quick
    assert budget - matched[1].seconds < slow.episodes[len(matched[1].episodes)].seconds


def test_collected(ours):
    quick, slow = load_groups(ours)
    assert (len(quick.episodes), quick.successes) == (12, 12)
    assert (slow.successes, slow.content["reasons"]) == (6, {"timeout": 6})
    assert quick.seconds == pytest.approx(sum(range(30, 42)) / 30)
    assert collected(slow, "")[1].estimate == pytest.approx(3600 * 6 / (sum(range(90, 102)) / 30))


def test_episodes_that_began_alike_are_paired(ours):
    quick, slow = load_groups(ours)
    assert shared_seeds(quick, slow) == [(place, place) for place in range(12)]
    again = replace(slow, episodes=(*slow.episodes, slow.episodes[0]))
    assert shared_seeds(quick, again) == []


def test_successes_an_hour(ours):
    quick, slow = load_groups(ours)
    ratio = rate_ratio(quick, slow, np.random.default_rng(0))
    rates = [collected(group, "")[1].estimate or 0.0 for group in (quick, slow)]
    assert ratio.estimate == pytest.approx(rates[0] / rates[1])
    assert 1.0 < ratio.interval[0] < ratio.estimate < ratio.interval[1]
    assert ratio.p < 0.01
    same = rate_ratio(quick, quick, np.random.default_rng(0))
    assert (same.estimate, same.interval, same.p) == (1.0, (1.0, 1.0), 1.0)
    few = replace(slow, episodes=slow.episodes[:5]), replace(quick, episodes=quick.episodes[7:])
    assert rate_ratio(*few, np.random.default_rng(0)).p > 0.005  # 2 of 252 permutations


def test_success_only(ours, tmp_path):
    comparison = compare(CompareConfig(tuple(ours), success_only=True))
    view = comparison.everything
    assert [len(group.episodes) for group in view.groups] == [12, 6]
    assert [len(group.episodes) for group in view.collected] == [12, 12]
    lines = answer_panels(comparison)[1].figure.axes[0].lines
    minutes = [group.seconds / 60 for group in view.collected]
    assert [line.get_xdata()[-1] for line in lines[::2]] == pytest.approx(minutes)  # failures take time, too


def test_success_only_ranks_no_unlike_tasks(ours):
    """Tasks in which every attempt failed count as well."""
    quick, slow = load_groups(ours)
    other = [replace(e, meta=e.meta | {"tasks": ["push"]}) for e in slow.episodes if not e.success]
    both = [replace(slow, episodes=(*filter(lambda e: e.success, slow.episodes), *other)), quick]
    comparison = compare(CompareConfig(tuple(ours), success_only=True))
    chosen = replace(comparison.everything, collected=both)
    assert replace(comparison, views=(chosen, *comparison.views[1:])).unlike == ("tasks",)


def test_what_an_episode_does_not_have_is_called_none(tmp_path):
    groups = load_groups([handrail_dataset(tmp_path / "set", 2, "ee", 4)], "failure_reason")
    assert {group.label for group in groups} == {"timeout", "none"}


def test_a_report_leaves_no_table_of_the_one_before(ours, tmp_path):
    report = dataset_report(compare(CompareConfig(tuple(ours))))
    report.write(tmp_path)
    assert (tmp_path / "episodes.csv").exists()
    (tmp_path / "notes.csv").write_text("mine")
    replace(report, units={}).write(tmp_path)
    assert sorted(path.name for path in tmp_path.glob("*.csv")) == ["differences.csv", "notes.csv"]


@pytest.mark.parametrize("values", [(False, True), (0, 0.3)])
def test_conditions_of_nothing_are_conditions(tmp_path, values):
    files = []
    for value in values:
        path = tmp_path / f"{value}.json"
        said = json.loads(Path(evaluations(path, 1, ee=0.5)).read_text())
        path.write_text(json.dumps(said | {"conditions": {"ee": {"pushed": value}}}))
        files.append(path)
    for some in (files, files[::-1]):
        with pytest.raises(HandrailError, match=r"expected pushed .* as before"):
            read_evaluations(some)


def test_episodes_of_several_persons_are_said_to_be_alike(ours):
    comparison = compare(CompareConfig(tuple(ours)))
    groups = comparison.everything.groups
    for ids, paired, said in (
        ([None], False, False),
        (["P1", "P2"], False, True),
        (["P1", "P2"], True, False),
    ):
        steered = [
            replace(
                each,
                episodes=tuple(
                    replace(e, meta=e.meta | {"participant": ids[k % len(ids)]})
                    for k, e in enumerate(each.episodes)
                ),
            )
            for each in groups
        ]
        found = [replace(each, paired=paired) for each in comparison.everything.differences]
        everything = {
            "groups": steered,
            "differences": found,
            "measurements": comparison.everything.measurements,
        }
        told = cautions(SimpleNamespace(everything=SimpleNamespace(**everything), outcomes=None))
        assert any("Several persons steered" in text for text, holds in told.items() if holds) == said
