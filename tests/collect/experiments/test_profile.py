"""`handrail-profile` works and writes what it promises; nothing here is timed."""

import json

import pytest

from handrail.collect.experiments.profiling.config import ProfileConfig
from handrail.collect.experiments.profiling.profiling import Profile, save
from handrail.collect.experiments.profiling.tables import profile_tables
from handrail.controllers.errors import HandrailError

CASE_KEYS = {"median_ms", "p95_ms", "p99_ms", "worst_ms", "pairs", "rows_mean", "phases_ms"}


def check(results):
    assert {"ratio_vs_ipopt", "ratio_vs_mink", "machine", "seed"} <= set(results)
    for case in ("no_collision", "pairs_30", "pairs_100"):
        assert set(results[case]) >= CASE_KEYS
    assert results["no_collision"]["pairs"] == 0
    assert results["pairs_30"]["pairs"] >= 30
    assert results["pairs_100"]["pairs"] >= 100


def test_a_tiny_run_writes_what_it_promises(tmp_path):
    results = Profile(ProfileConfig(updates=10, rivals=False, growth=False)).run()
    check(results)
    assert results["ratio_vs_ipopt"] is None
    save(results, str(tmp_path / "profile.json"))
    check(json.loads((tmp_path / "profile.json").read_text()))
    assert len(profile_tables(results).renderables) == 4


def test_rivals_solve_the_same_problems():
    pytest.importorskip("mink")
    results = Profile(ProfileConfig(updates=10, solves=1, growth=False)).run()
    check(results)
    assert results["ratio_vs_ipopt"] > 0
    assert results["ratio_vs_mink"] > 0
    mink = next(rival for rival in results["rivals"]["pairs_30"] if rival["name"] == "mink")
    assert mink["pairs"] == results["pairs_30"]["pairs"]
    assert mink["failed"] == 0


@pytest.mark.parametrize(
    ("config", "said"),
    [
        (ProfileConfig(updates=3), "--updates 3: expected a whole number >= 10"),
        (ProfileConfig(json="/nowhere/at/all.json"), "--json /nowhere/at/all.json: expected a file in an"),
    ],
)
def test_bad_settings_are_named(config, said):
    with pytest.raises(HandrailError, match=said):
        config.check()
