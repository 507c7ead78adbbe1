"""The bench `speed` works, goes on where it stopped, and writes what it promises; nothing here is timed."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest
from plans import cost, violation

from handrail.controllers.errors import HandrailError
from handrail.controllers.solvers.dense import dense
from handrail.controllers.solvers.real_time import RealTimeSolver
from handrail.datasets.presentation.terminal import Terminal
from handrail.scripts.bench.speed.peers import PEERS
from handrail.scripts.bench.speed.speed import DEGREES, SpeedConfig, main, measure
from handrail.scripts.bench.speed.timing_loop import SpeedCase, TimingLoop

QUIET = Terminal(quiet=True)
ONE = {"degrees": (9,), "pairs": (40,), "horizons": (10,), "updates": 10, "solves": 10}
TINY = SpeedConfig(**ONE, peers="mink", tasks="reach", robots="")


def test_a_tiny_run_writes_what_it_promises_and_goes_on_where_it_stopped(tmp_path):
    pytest.importorskip("mink")
    config = replace(TINY, json=str(tmp_path / "speed.json"), page=str(tmp_path / "speed.md"))
    assert main(config) == 0
    (row,) = json.loads((tmp_path / "speed.json").read_text())["rows"]
    assert (row["degrees"], row["pairs"], row["horizon"], row["watched_pairs"]) == (9, 40, 10, 40)
    assert row["cpu"].keys() == row["wall"].keys() == {"median_ms", "p95_ms", "p99_ms", "worst_ms"}
    assert min(row["first_ms"].values()) > 0
    assert (row["peers"]["mink"]["solves"], row["peers"]["mink"]["failed"]) == (9, 0)
    assert (tmp_path / "speed.png").stat().st_size > 1000
    assert "| 9 | 10 | 40 |" in (tmp_path / "speed.md").read_text()
    measure(replace(config, pairs=(0, 40), robots="lekiwi"), QUIET)
    rows = {each["name"]: each for each in json.loads((tmp_path / "speed.json").read_text())["rows"]}
    assert len(rows) == 3
    assert rows[row["name"]] == row  # it was not measured again
    reach = rows["lekiwi reach"]
    assert reach["successes"] == reach["episodes"]
    assert reach["updates"] >= 10
    with pytest.raises(HandrailError, match="choose another file"):
        measure(replace(config, seed=1), QUIET)


@pytest.mark.parametrize("degrees", DEGREES)
def test_a_case_has_the_degrees_and_about_the_pairs_that_it_says(degrees):
    for pairs in (0, 40, 120):
        loop = TimingLoop(SpeedCase(degrees, pairs), 0)
        loop.run(1)
        assert loop.model.size == degrees
        found = loop.mpc.loop.surroundings.collision.size
        assert abs(found - pairs) <= len(loop.model.description.collision) / 2


@pytest.mark.parametrize("case", [SpeedCase(9, 0), SpeedCase(9, 40), SpeedCase(18, 40)])
def test_every_qp_solver_finds_the_same_minimum_within_the_same_rows(case):
    pytest.importorskip("piqp")
    loop = TimingLoop(case, 1)
    solver = RealTimeSolver(loop.mpc.residuals, case.horizon, loop.model.size)
    takes = {name: PEERS[name](loop) for name in ("own_qp", "daqp", "piqp")}
    for update in loop.run(8):
        qp = dense(solver.program(update.problem, update.guess), update.problem.collision.memory)
        found = [take(update)() for take in takes.values()]
        values = np.array([cost(qp, x) for x in found])
        assert max(violation(qp, x) for x in found) < 2e-5
        assert np.ptp(values) < 1e-3 * (1e-3 + np.abs(values).min())


def test_a_missing_peer_is_said(monkeypatch):
    monkeypatch.setitem(sys.modules, "pink", None)
    with pytest.raises(HandrailError, match="pin-pink"):
        PEERS["pink"](TimingLoop(SpeedCase(), 0))
