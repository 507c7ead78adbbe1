"""What the page of the paper's benchmark says in words agrees with the JSON beside it."""

import json
import re
from dataclasses import asdict
from functools import cache

import numpy as np
import pytest
from places import ROOT
from results_helpers import RESULTS, words

from handrail.datasets.statistics.paired import paired_difference, paired_success
from handrail.scripts.bench.goal_reaching.metrics import METRICS

TEXT = words((RESULTS / "goal_reaching.md").read_text())


@cache
def runs():
    """Return what the goal-reaching page keeps, by kind of run."""
    files = sorted(RESULTS.glob("goal_reaching_*.json"))
    return {file.stem.removeprefix("goal_reaching_"): json.loads(file.read_text()) for file in files}


def nominal(seed, name, metric, digits):
    return f"{runs()[f'nominal_seed_{seed}']['controllers'][name][metric]['mean']:.{digits}f}"


def test_the_readme_s_results_are_those_of_the_pages():
    readme = words((ROOT / "README.md").read_text())
    reached = {
        name: sum(
            round(run["success"]["mean"] * run["episodes"])
            for run in (runs()[f"nominal_seed_{seed}"]["controllers"][name] for seed in (1, 2, 3))
        )
        for name in ("mpc", "mink")
    }
    assert f"reached {reached['mpc']} of 300 goals without contact; `mink` {reached['mink']}" in readme
    clutter = runs()["nominal_clutter_seed_1"]["controllers"]["mpc"]
    assert f"touched nothing, and reached {100 * clutter['success']['mean']:.0f} of 100" in readme


def test_the_first_table_of_goal_reaching_is_that_of_the_runs():
    columns = (("success", 0), ("arm_effort", 1), ("jerkiness", 3), ("base_path", 2), ("length", 0))
    for name in ("mpc", "mpc_paper", "mink", "rl", "dls"):
        found = [runs()[f"nominal_seed_{seed}"]["controllers"][name] for seed in (1, 2, 3)]
        cells = [
            ", ".join(f"{(100 if key == 'success' else 1) * each[key]['mean']:.{digits}f}" for each in found)
            for key, digits in columns
        ]
        touched = ", ".join(str(each["episodes_with_contact"]) for each in found)
        assert f"| `{name}` | {' | '.join(cells)} | {touched} |" in TEXT


def test_direct_is_the_controller_that_dls_is():
    """In everything that is measured but times and what it is called."""
    for run in runs().values():
        if "direct" in run["controllers"]:
            one, other = (run["controllers"][name] for name in ("dls", "direct"))
            for metric in METRICS:
                if metric != "wall_time_s":
                    assert one[metric] == other[metric]


def test_the_closed_loop_is_told_as_it_came_out():
    mpc = runs()["nominal_closed_loop_whole_seed_1"]["controllers"]["mpc"]
    before, after = mpc["planned_position_error"], mpc["final_position_error"]
    missed = f"{mpc['beyond_aim']['planned_position_error']} of {mpc['episodes']} goals beyond 10 mm"
    assert (
        f"{1e3 * before['mean']:.1f} mm off in the mean and {1e3 * before['max']:.1f} mm at worst, {missed}"
        in TEXT
    )
    assert f"it is {1e3 * after['mean']:.1f} mm and {1e3 * after['max']:.1f} mm" in TEXT
    assert ("**That is so**" in TEXT) == (
        after["mean"] < before["mean"] and after["max"] < before["max"] < 0.01
    )


def test_time_is_told_by_the_update_and_its_rate():
    took = [nominal(1, name, "update_ms_median", 2) for name in ("mpc", "rl")]
    rates = [nominal(1, name, "updates_per_s", 0) for name in ("mpc", "rl")]
    assert f"{took[0]} against {took[1]} ms" in TEXT
    assert f"{rates[0]} against {rates[1]} a second" in TEXT
    pages = (*RESULTS.glob("*.md"), *(ROOT / "docs").glob("*.md"), ROOT / "README.md", ROOT / "CHANGELOG.md")
    for document in pages:
        assert not re.search(r"% of the actor's (wall )?time", words(document.read_text()))


def test_what_the_low_pass_does_for_rivals_is_told():
    profiles = runs()["profiles_seed_1"]["profiles"]
    for profile in ("steps", "quantised"):
        for rival in ("mink", "rl"):
            bare, smooth = (
                f"{100 * profiles[profile][name]['success']['mean']:.0f}"
                for name in (rival, f"{rival}_low_pass")
            )
            assert f"`{rival}` {smooth} instead of {bare} of 100 goals ({profile})" in TEXT


def test_every_run_has_its_episodes_as_the_page_says():
    assert len(runs()) == 8
    assert all("episodes" in run for run in runs().values())


@pytest.mark.parametrize("label", runs())
def test_a_reader_can_repeat_every_table_and_test_from_the_episodes(label):
    """All but the times."""
    run = runs()[label]
    for profile, episodes in run["episodes"].items():
        first, *others = episodes
        for name, measured in episodes.items():
            assert {len(values) for values in measured.values()} == {run["config"]["goals"]}
            for metric, values in measured.items():
                known = np.array([each for each in values if each is not None], float)
                if len(known):
                    summary = run["profiles"][profile][name][metric]
                    spread = known.std(ddof=1) if len(known) > 1 else 0.0
                    found = (known.mean(), spread, known.min(), known.max())
                    told = [summary[key] for key in ("mean", "std", "min", "max")]
                    assert found == pytest.approx(told, rel=1e-9)
        for name in others:
            published = run["paired"][profile][name]
            one, other = episodes[first], episodes[name]
            success = paired_success(*(np.array(each["success"], float) for each in (one, other)))
            assert asdict(success) == published["success"]
            for metric in METRICS[1:-1]:
                pair = np.array(one[metric], float), np.array(other[metric], float)
                found, told = paired_difference(*pair, np.random.default_rng(0)), published[metric]
                assert [found.pairs, found.mean, found.p_wilcoxon, *found.t_interval] == pytest.approx(
                    [told["pairs"], told["mean"], told["p_wilcoxon"], *told["t_interval"]], rel=1e-6
                )
