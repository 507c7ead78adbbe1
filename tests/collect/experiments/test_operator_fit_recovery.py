"""Scripted operators whose numbers are known are found again, within the intervals of what is told."""

import json

import numpy as np
import pytest
from command_helpers import command

from handrail.collect.experiments.operator_fit.episodes import read_steered
from handrail.collect.experiments.operator_fit.fit import fit_operator
from handrail.collect.operators.human.human import HumanSettings

OTHER = {"delay": 0.35, "refractory": 0.5, "noise": 0.2, "briskness": 1.6}
ALWAYS_TOLD = {"movement", "briskness", "noise", "refractory"}
_WIDER = 1.05  # of an interval's ends: one of many may miss by a little


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "numbers"), [(6, {}), (5, OTHER)], ids=["defaults", "others"])
def test_known_numbers_are_found_again(seed, numbers, tmp_path):
    flags = [word for name, value in numbers.items() for word in (f"--human.{name}", value)]
    root = tmp_path / "recorded"
    recording = ("--task", "reach", "--dataset.num_episodes", "14", "--human.persons", "0")
    done = command(*recording, *flags, "--seed", seed, "--dataset.root", root)
    assert done.returncode == 0, done.stderr
    fit = fit_operator(list(read_steered(root)), 120, np.random.default_rng(0))
    found = {each.name: each for each in fit.estimates if each.value is not None}
    assert set(found) >= ALWAYS_TOLD
    for name, each in found.items():
        truth = numbers.get(name, getattr(HumanSettings(), name))
        low, high = each.interval or (np.nan, np.nan)
        assert low / _WIDER <= truth <= high * _WIDER, (name, each)
    differing = {name for name, each in found.items() if each.differs}
    assert differing <= set(numbers)  # nothing is said to differ that does not
    if not numbers:
        assert fit.likeness.default < 2.0
    else:
        assert fit.likeness.fitted < 0.5 * fit.likeness.default
        assert differing >= {"delay", "briskness"}


@pytest.mark.slow
def test_the_command_prints_a_table_and_writes_the_same(tmp_path):
    root, output = tmp_path / "recorded", tmp_path / "fit.json"
    recording = ("--task", "reach", "--no_physics", "--dataset.num_episodes", "3", "--dataset.root", root)
    assert command(*recording).returncode == 0
    words = (root, "--episodes", "2", "--draws", "50", "--output", output)
    done = command(*words, name="fit_operator")
    assert done.returncode == 0, done.stderr
    told = json.loads(output.read_text())
    assert told["format"] == "handrail.operator_fit/1"
    assert told["episodes"] == 2
    assert all(sentence in done.stdout for sentence in told["sentences"])
    assert "Too few episodes for intervals" in done.stdout
    again = tmp_path / "again.json"
    assert command(*words[:-1], again, name="fit_operator").returncode == 0
    assert again.read_text() == output.read_text()  # the same seed, the same fit
