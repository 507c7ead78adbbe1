"""Laws of what installed packages bring: broken, it is left out with a warning, or is one line."""

import os
import subprocess
import sys

import numpy as np
import pytest
from datasets_helpers import record

from handrail.collect.operators.modes import MODES
from handrail.controllers.errors import HandrailError
from handrail.controllers.registry import fitting
from handrail.datasets.quality.measure import measure
from handrail.datasets.quality.metric import metric
from handrail.datasets.reading.load import some_recorded


@pytest.fixture
def broken(tmp_path):
    """A folder of the path with a package whose entry points cannot be imported."""
    info = tmp_path / "broken_kit-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: broken-kit\nVersion: 1.0\n")
    entries = "[handrail.metrics]\nheat = no_such_kit:heat\n[handrail.modes]\nwand = no_such_kit:WAND\n"
    (info / "entry_points.txt").write_text(entries)
    return tmp_path


def test_a_command_that_needs_no_metric_minds_no_broken_one(broken):
    root = record(broken / "dataset", 2)
    words = [sys.executable, "-m", "handrail.scripts", "edit", "repair", str(root)]
    variables = {**os.environ, "PYTHONPATH": str(broken)}
    done = subprocess.run(words, env=variables, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    said = [line for line in done.stderr.splitlines() if "heat" in line]
    assert said == ["metric heat: cannot import it: No module named 'no_such_kit'; it is left out"]


def test_a_broken_mode_is_not_offered(broken, monkeypatch, caplog):
    before = list(fitting(MODES, 1))
    monkeypatch.syspath_prepend(broken)
    assert "wand" in MODES
    assert list(fitting(MODES, 1)) == before
    assert caplog.messages == ["mode wand: cannot import it: No module named 'no_such_kit'; it is left out"]


@pytest.mark.parametrize(
    ("answer", "why"),
    [(lambda: 1 / 0, "division by zero"), (lambda: None, "float"), (lambda: np.ones(3), "array")],
)
def test_a_metric_without_a_number_is_one_line(tmp_path, answer, why):
    @metric("s", "lower")
    def heat(episode, scale):
        return answer()

    episodes = some_recorded(record(tmp_path / "dataset", 2))
    with pytest.raises(HandrailError, match=f"^metric heat of episode 0: .*{why}.*$"):
        measure({"": episodes}, np.random.default_rng(0), metrics=[heat])
