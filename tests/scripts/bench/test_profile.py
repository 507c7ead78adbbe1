"""The bench `speed` works and writes what it promises; nothing here is timed."""

import json

import pytest

from handrail.datasets.storage.strict_json import write_json
from handrail.scripts.bench.speed.config import ProfileConfig
from handrail.scripts.bench.speed.profiling import profile
from handrail.scripts.bench.speed.qp import compare_qp
from handrail.scripts.bench.speed.tables import profile_tables

CASE_KEYS = {"median_ms", "p95_ms", "p99_ms", "worst_ms", "pairs", "rows_mean", "phases_ms"}


def test_a_tiny_run_writes_what_it_promises_and_rivals_solve_the_same_problems(tmp_path):
    pytest.importorskip("mink")
    config = ProfileConfig(updates=10, solves=1, growth=False, qps=0, tasks="reach", robots="lekiwi")
    results = profile(config)
    assert {"growth", "rivals", "machine", "seed"} <= set(results)
    for case in ("no_collision", "pairs_30", "pairs_100"):
        assert set(results[case]) >= CASE_KEYS
    pairs = [results[case]["pairs"] for case in ("no_collision", "pairs_30", "pairs_100")]
    assert pairs[0] == 0
    assert pairs[1] >= 30
    assert pairs[2] >= 100
    (reach,) = results["tasks"]
    assert (reach["robot"], reach["task"], reach["successes"]) == ("lekiwi", "reach", reach["episodes"])
    assert reach["updates"] >= 10
    assert reach["cpu"]["median_ms"] > 0
    assert set(reach["phases_ms"]) == {"distances", "residuals", "solve", "rest"}
    assert min(results["ratio_vs_ipopt"], results["ratio_vs_mink"]) > 0
    mink = next(each for each in results["rivals"]["pairs_30"] if each["name"] == "mink")
    assert (mink["solves"], mink["failed"]) == (results["pairs_30"]["updates"], 0)
    write_json(tmp_path / "profile.json", results)
    assert json.loads((tmp_path / "profile.json").read_text()).keys() == results.keys()
    assert profile_tables(results)


def test_every_qp_solver_solves_the_same_qps():
    """All find the same minimum within the same rows; what is timed is theirs, so that the ratio is one."""
    pytest.importorskip("piqp")
    results = compare_qp(8, seed=1, horizons=(10,))
    assert results["no_collision_horizon_10"]["pairs"] == 0
    assert all(case["stages"] == 10 for case in results.values())
    for case in results.values():
        assert set(case["solvers"]) == {"own", "daqp", "piqp"}
        for entry in case["solvers"].values():
            assert entry["failed"] == 0
            assert entry["violation"] < 2e-5
            assert entry["objective_excess_worst"] < 1e-3
            assert entry["ratio"] * entry["median_ms"] == pytest.approx(case["solvers"]["own"]["median_ms"])
