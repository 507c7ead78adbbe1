"""The examples run as they stand, are short, and show what their first line promises."""

import re
import runpy
import sys

import numpy as np
import pytest
from canned import canned, record_by_command
from places import ROOT

EXAMPLES = ROOT / "docs" / "examples"
NAMES = (
    *("another_arm", "dataset_metric", "gym_policy", "mpc_loop", "new_controller", "new_task"),
    "record_with_mpc",
)
LONGEST = 60  # lines


def shown(name, capsys, monkeypatch, *arguments):
    """Run an example as a script; return what it printed."""
    file = EXAMPLES / f"{name}.py"
    monkeypatch.setattr(sys, "argv", [str(file), *map(str, arguments)])
    runpy.run_path(str(file), run_name="__main__")
    return capsys.readouterr().out


def test_each_example_is_short_and_listed_on_the_api_page():
    assert {path.stem for path in EXAMPLES.glob("*.py")} == set(NAMES)
    page = (ROOT / "docs" / "api.md").read_text()
    for name in NAMES:
        lines = (EXAMPLES / f"{name}.py").read_text().splitlines()
        assert len(lines) <= LONGEST, name
        assert f"python docs/examples/{name}.py" in "\n".join(lines[:6])
        assert f"(examples/{name}.py)" in page


def test_the_mpc_in_a_loop_goes_round_the_pillar_and_the_hand_straight_on(capsys, monkeypatch):
    out = shown("mpc_loop", capsys, monkeypatch)
    hand = [list(map(float, row.split())) for row in re.findall(r"hand moved \[(.*?)\]", out)]
    aside = float(re.search(r"went ([\d.]+) m aside", out)[1])
    assert hand[-1] == pytest.approx([1.48, 0.0, 0.0], abs=0.03)
    assert aside > 0.2
    assert set(re.findall(r"status (\w+)", out)) == {"ok"}


def test_a_policy_reaches_its_goals_in_a_gymnasium_environment(capsys, monkeypatch):
    assert shown("gym_policy", capsys, monkeypatch).count("reached after") == 3


def test_a_task_from_outside_is_done(capsys, monkeypatch):
    monkeypatch.syspath_prepend(EXAMPLES)
    assert shown("new_task", capsys, monkeypatch).count("touched after") == 3


def test_a_controller_of_one_s_own_reaches_some_goals(capsys, monkeypatch):
    assert 1 <= shown("new_controller", capsys, monkeypatch).count("reached after") <= 3


def test_a_metric_of_a_dataset_is_computed(capsys, monkeypatch):
    recorded = canned(record_by_command, "--task reach --dataset.num_episodes 2")
    out = shown("dataset_metric", capsys, monkeypatch, recorded)
    assert out.count("done in") == 2
    assert -6.0 < float(re.search(r"\(SPARC\): (-[\d.]+)", out)[1]) < -1.4


def test_another_arm_draws_its_square_and_keeps_from_the_box(capsys, monkeypatch):
    out = shown("another_arm", capsys, monkeypatch)
    hand = [[float(number) for number in row.split()] for row in re.findall(r"hand at \[(.*?)\]", out)]
    corners = [[0.0, 0.08, 0.0], [0.0, 0.08, 0.06], [0.0, 0.0, 0.06], [0.0, 0.0, 0.0]]
    assert np.abs(np.array(hand[:4]) - corners).max() < 0.01
    assert hand[4][1] > -0.06  # the box is in the way
    assert float(re.search(r"nearest to anything: (-?[\d.]+)", out)[1]) > 0.02
