"""Laws of what installed packages bring: broken, it is left out with a warning, or is one line."""

import os
import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from datasets_helpers import record

from handrail.collect.config import SessionConfig
from handrail.collect.operators.modes import MODES, TeleopMode, always
from handrail.collect.session.build import build_env, build_modes
from handrail.controllers.baselines.catalogue import ControllerSpec
from handrail.controllers.errors import HandrailError
from handrail.controllers.registry import fitting
from handrail.datasets.quality.consistency import state_coverage
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


def test_a_package_changes_no_place_of_handrail_s_own_modes(broken, monkeypatch):
    """LeRobot's robot observes a mode as its place."""
    before = list(MODES)
    assert before[-1] == "rl"  # which is an entry point, as a package's modes are
    monkeypatch.syspath_prepend(broken)
    assert list(MODES) == [*before, "wand"]


WHOLE = ControllerSpec("whole", lambda model, period: None, "a controller that is there")
PART = ControllerSpec("part", "no_such_kit:PART", "a controller whose class is missing")
OF_PART = TeleopMode("of_part", always("hand"), f"{__name__}:PART", "its controller's class is missing")
OF_WHOLE = TeleopMode("of_whole", always("hand"), f"{__name__}:WHOLE", "all is there")
OF_NONE = TeleopMode("of_none", always("hand"), "no_such_kit:NONE", "its controller is missing")


def test_a_mode_without_its_controller_is_left_out_unless_it_is_the_chosen_one(tmp_path, monkeypatch, caplog):
    info = tmp_path / "half_kit-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: half-kit\nVersion: 1.0\n")
    names = ("of_part", "of_whole", "of_none")
    lines = (f"{name} = {__name__}:{name.upper()}\n" for name in names)
    (info / "entry_points.txt").write_text("[handrail.modes]\n" + "".join(lines))
    monkeypatch.syspath_prepend(tmp_path)
    config = SessionConfig(task="reach", physics=False)
    env = build_env(config, 20)
    offered = build_modes(config, env)
    assert [name for name in names if name in offered] == ["of_whole"]
    missing = "cannot import it: No module named 'no_such_kit'"
    assert [line for line in caplog.messages if "no_such_kit" in line] == [
        f"mode of_part: no_such_kit:PART: {missing}; it is left out",
        f"mode of_none: controller no_such_kit:NONE: {missing}; it is left out",
    ]
    with pytest.raises(HandrailError, match=r"^mode of_none: controller no_such_kit:NONE: cannot import it"):
        build_modes(replace(config, mode="of_none"), env)


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


@pytest.mark.parametrize(
    ("answer", "why"),
    [(lambda: 1 / 0, "division by zero"), (lambda: None, ""), (lambda: np.ones(3), "index")],
)
def test_a_metric_of_a_dataset_that_fails_says_so_and_the_others_go_on(tmp_path, answer, why):
    @metric("s", "lower", of_dataset=True)
    def heat(dataset, rng):
        return answer()

    episodes = some_recorded(record(tmp_path / "dataset", 2))
    values = measure({"": episodes}, np.random.default_rng(0), metrics=[heat, state_coverage]).values
    assert values["heat"][""].estimate is None
    assert re.match(f"{__name__}:heat failed: .*{why}", values["heat"][""].reason)
    assert values["state_coverage"][""].estimate is not None
