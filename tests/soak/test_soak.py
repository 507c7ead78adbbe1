"""A short soak: whatever befalls a recording, what was saved stays, and the same command finishes it."""

import json
import subprocess
import sys

import pytest
from places import ROOT

pytestmark = pytest.mark.slow
SOAK = ROOT / "tests" / "soak" / "soak.py"


def soak(out, *flags):
    words = [sys.executable, str(SOAK), str(out), *map(str, flags)]
    subprocess.run(words, check=True, capture_output=True)
    return [json.loads(line) for line in (out / "rounds.jsonl").read_text().splitlines()]


@pytest.mark.parametrize("fault", ["SIGKILL of the command", "Ctrl-C"])
def test_faults_cost_nothing_saved(tmp_path, fault):
    rows = soak(tmp_path, "--rounds", 1, "--fault", fault, "--work", "record")
    assert [row["complaints"] for row in rows] == [[]]
    assert rows[0]["lost"] == 0
    assert [row["round"] for row in soak(tmp_path, "--rounds", 1, "--work", "replay")] == [0, 1]
