"""A published study's numbers, computed anew by a script that shares no code with the report."""

import json
import re
import subprocess
import sys
import tarfile

import numpy as np
import pytest
from places import ROOT

RESULTS = ROOT / "docs" / "results"
LINE = r"(\w+): (\S+) \((\S+) to (\S+)\), 8 draws, p (\S+), after Holm (\S+)"


def test_what_was_declared_comes_out_as_published():
    archive = RESULTS / "teleop_modes_factors.tar.xz"
    design = RESULTS / "teleop_modes_factors.toml"
    done = subprocess.run(
        [sys.executable, RESULTS / "recompute.py", archive, design],
        capture_output=True,
        text=True,
        check=True,
    )
    found = {name: [float(each) for each in numbers] for name, *numbers in re.findall(LINE, done.stdout)}
    published = json.loads((RESULTS / "teleop_modes_factors.json").read_text())["contrasts"]
    declared = {each["name"].partition(":")[0]: each for each in published if each["kind"] == "declared"}
    assert len(declared) == 3
    assert found.keys() == declared.keys()
    for name, each in declared.items():
        estimate = each["estimate"]
        shares = [100 * share for share in (estimate["value"], *estimate["interval"])]
        assert found[name] == pytest.approx([*shares, estimate["p"], each["p_adjusted"]], abs=1e-3)


def test_an_archive_that_lacks_a_draw_is_not_tested(tmp_path):
    design = tmp_path / "more.toml"
    factors = (RESULTS / "teleop_modes_factors.toml").read_text()
    design.write_text(factors.replace("draws = 8", "draws = 9"))
    script = [sys.executable, RESULTS / "recompute.py", RESULTS / "teleop_modes_factors.tar.xz", design]
    done = subprocess.run(script, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "expected 9 draws of each policy" in done.stderr
    assert not done.stdout


@pytest.mark.parametrize("amounts", [1, 3])
def test_the_metric_that_goes_with_success_is_named_first(tmp_path, amounts):
    """What several amounts of the same recordings say is said once: p is as of one of them."""
    rng, draws = np.random.default_rng(0), range(3)
    shares = {(mode, draw): rng.random() for mode in "abcd" for draw in draws}
    jobs = {
        f"collect/reach/{mode}/{draw}": {"result": {"quality": {"telling": -share, "other": rng.random()}}}
        for (mode, draw), share in shares.items()
    }
    conditions = [
        {
            "task": "reach",
            "label": f"{mode} {amount} min" if amount else mode,
            "treatment": "",
            "draws": {str(draw): shares[mode, draw] for draw in draws},
        }
        for mode in "abcd"
        for amount in range(amounts)
    ]
    study = {"design": {"draws": 3}, "jobs": jobs, "conditions": conditions}
    (tmp_path / "study.json").write_text(json.dumps(study))
    done = subprocess.run(
        [sys.executable, RESULTS / "metrics.py", tmp_path / "study.json"],
        capture_output=True,
        text=True,
        check=True,
    )
    count, first, other = done.stdout.splitlines()
    assert count == f"{amounts} groups, {12 * amounts} policies"
    assert first.startswith("telling: -1.00 (-1.00 to -1.00), p ")
    assert float(first.split()[-1]) == pytest.approx(1 / 24, abs=0.02)  # of all orders of four modes
    assert other.startswith("other: ")


def test_a_mode_that_needs_twice_the_minutes_is_said_to(tmp_path):
    rng = np.random.default_rng(0)
    for mode, factor in (("quick", 1.0), ("slow", 2.0)):
        for draw in range(4):
            for minutes in (3, 5, 10, 20):
                share = 1 / (1 + (6.0 * factor / minutes) ** 2)
                rollouts = [{"success": bool(rng.random() < share)} for _ in range(200)]
                learnt = {"operator_time": 60.0 * minutes, "episodes": 12.0 * minutes / factor}
                file = tmp_path / f"evaluations/reach/{mode}/{draw}/nominal/realised-time-{minutes}.json"
                file.parent.mkdir(parents=True, exist_ok=True)
                arms = {mode: [{"trained_on": learnt, "rollouts": rollouts}]}
                file.write_text(json.dumps({"arms": arms}))
    archive = tmp_path / "study.tar.xz"
    with tarfile.open(archive, "w:xz") as file:
        file.add(tmp_path / "evaluations", "evaluations")
    script = [sys.executable, RESULTS / "minutes.py", archive, "quick", "slow"]
    done = subprocess.run(script, capture_output=True, text=True, check=True)
    said = re.findall(r"reach, (\w+): slow / quick (\S+) \((\S+) to (\S+)\), 4 draws", done.stdout)
    ratios = {name: [float(each) for each in numbers] for name, *numbers in said}
    for name, true in (("minutes", 2.0), ("demonstrations", 1.0)):
        ratio, low, high = ratios[name]
        assert low < true < high
        assert ratio == pytest.approx(true, rel=0.15)
