"""The figures on the pages of results, and README's, are those of the JSON beside them."""

import json
import lzma
import re
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from pages import RESULTS, text
from places import ROOT

from handrail.datasets.statistics.paired import paired_difference, paired_success
from handrail.scripts.bench.goal_reaching.metrics import METRICS

FOLDER = ROOT / "docs" / "results"
NUMBERS = {file.stem: json.loads(file.read_text()) for file in sorted(FOLDER.glob("*.json"))} | {
    file.name.partition(".")[0]: json.loads(lzma.decompress(file.read_bytes()))
    for file in sorted(FOLDER.glob("*.json.xz"))
}
RUNS = {name: run for name, run in NUMBERS.items() if name.startswith("goal_reaching_")}
PAGES = [page for page in RESULTS if any(name.startswith(Path(page).stem) for name in NUMBERS)]
UNITS = (1, 100, 1000, 1e-6, 1 / 60)  # %, mm and ms, millions, minutes
OTHERS = {  # figures of the paper and the machine, and differences of two figures of the page
    "goal_reaching": {"340.6"},
    "diagnosis_direct": {"6.8"},
    "operators": {"31.7", "35.4", "39.7", "63.4", "75.9", "90.6", "93.2"},
    "teleop_modes_beside": {"3.96"},  # minutes over successes
    "takeover": {"118.2", "4.22", "4.37", "44.9", "45.8", "85.1", "9.59"},  # sums over draws
    "showcase": {"0.15", "0.25", "1.5"},
    "soak": {"1.16"},
}


def numbers_in(content) -> Iterator[float]:
    """Yield all numbers of a JSON file but those of single episodes of the benchmark."""
    if isinstance(content, dict):
        for key, value in content.items():
            yield from () if key == "episodes" and isinstance(value, dict) else numbers_in(value)
    elif isinstance(content, list):
        for value in content:
            yield from numbers_in(value)
    elif isinstance(content, int | float):
        yield abs(content)


@pytest.mark.parametrize("page", PAGES)
def test_every_figure_of_a_page_is_one_of_its_numbers(page):
    """Rounded as it is written, in one of the units."""
    stem = Path(page).stem
    numbers = [each for name in NUMBERS if name.startswith(stem) for each in numbers_in(NUMBERS[name])]
    figures = set(re.findall(r"(?<![\w.`])\d+\.\d+(?![\w.`])", text(page)))
    for digits in {len(figure.partition(".")[2]) for figure in figures}:
        figures -= {f"{number * unit:.{digits}f}" for number in numbers for unit in UNITS}
    assert figures == OTHERS.get(stem, set())


def plain(page: str) -> str:
    return " ".join(text(page).replace("**", "").split())


def test_the_first_table_of_goal_reaching_is_that_of_the_runs():
    columns = (("success", 0), ("arm_effort", 1), ("jerkiness", 3), ("base_path", 2), ("length", 0))
    page, readme = plain("docs/results/goal_reaching.md"), plain("README.md")
    for name in ("mpc", "mpc_paper", "mpc_one_stage", "mink", "dls_base", "blended", "rl", "dls"):
        found = [RUNS[f"goal_reaching_nominal_seed_{seed}"]["controllers"][name] for seed in (1, 2, 3)]
        cells = [
            ", ".join(f"{(100 if key == 'success' else 1) * each[key]['mean']:.{digits}f}" for each in found)
            for key, digits in columns
        ]
        touched = ", ".join(str(each["episodes_with_contact"]) for each in found)
        assert f"| `{name}` | {' | '.join(cells)} | {touched} |" in page
        reached = sum(round(each["success"]["mean"] * each["episodes"]) for each in found)
        assert name not in ("mpc", "mink") or re.search(rf"(mpc|MPC|`mink`)\D* {reached}\b", readme)


@pytest.mark.parametrize("name", RUNS)
def test_a_reader_can_repeat_every_table_and_test_from_the_episodes(name):
    """All but the times."""
    run = RUNS[name]
    for profile, episodes in run["episodes"].items():
        measured = {
            controller: {metric: np.array(values, float) for metric, values in each.items()}
            for controller, each in episodes.items()
        }
        first, *others = measured
        for controller, each in measured.items():
            assert {len(values) for values in each.values()} == {run["config"]["goals"]}
            for metric in each:
                known = each[metric][~np.isnan(each[metric])]
                if len(known):
                    spread = known.std(ddof=1) if len(known) > 1 else 0.0
                    summary = run["profiles"][profile][controller][metric]
                    told = [summary[key] for key in ("mean", "std", "min", "max")]
                    assert (known.mean(), spread, known.min(), known.max()) == pytest.approx(told, rel=1e-9)
        for controller in others:
            published = run["paired"][profile][controller]
            pair = measured[first], measured[controller]
            assert asdict(paired_success(pair[0]["success"], pair[1]["success"])) == published["success"]
            for metric in METRICS[1:-1]:
                rng = np.random.default_rng(0)
                found, told = paired_difference(pair[0][metric], pair[1][metric], rng), published[metric]
                assert [found.pairs, found.mean, found.p_wilcoxon, *found.t_interval] == pytest.approx(
                    [told["pairs"], told["mean"], told["p_wilcoxon"], *told["t_interval"]], rel=1e-6
                )
