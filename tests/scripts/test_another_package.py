"""What another package adds is recorded, replayed, trained on and evaluated; no file makes it be imported."""

import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace

import pytest
from canned import canned
from command_helpers import ran, refused
from press_kit import PRESS
from training_helpers import TINY

from handrail.collect.operators.modes import MODES
from handrail.controllers.errors import HandrailError
from handrail.datasets.reading.reader import read_episodes, read_frames
from handrail.policies.imitation.evaluation.conditions import policy_conditions
from handrail.policies.imitation.evaluation.config import EvaluateConfig
from handrail.policies.imitation.interface.checkpoint import NAME
from handrail.policies.study.design import StudyDesign, TaskDesign

NAMED = {
    flag: f"press_kit:{entry}"
    for flag, entry in {"--task": "PRESS", "--mode": "HAND", "--operator": "EXACT", "--robot": "TWIN"}.items()
}
METRIC = '''
from handrail.datasets.quality.metric import metric

@metric("s", "lower")
def presses(episode, scale):
    """How long the press took."""
    return episode.seconds
'''
SAID = [word for pair in NAMED.items() for word in pair]


def said(*flags):
    return [word for flag in flags for word in (flag, NAMED[flag])]


def press(root):
    ran(root, *SAID, "--dataset.num_episodes", 1)


def act_of_press(folder):
    """Train a policy on that dataset, not for long."""
    words = f"--output {folder} --actions intent --steps 2 --batch_size 4 --policy_options".split()
    ran(canned(press), *said("--mode"), *words, *TINY, name="train")


@pytest.fixture
def recorded():
    return canned(press)


@pytest.fixture
def trained():
    return canned(act_of_press)


@pytest.fixture
def unseen(monkeypatch):
    """The package as it is before anybody imports it."""
    monkeypatch.delitem(sys.modules, "press_kit")
    return lambda: "press_kit" not in sys.modules


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """A package that is installed and declares the task as an entry point."""
    install(tmp_path, "[handrail.tasks]\npress = press_kit:PRESS\n")
    monkeypatch.syspath_prepend(tmp_path)


def install(folder, entries):
    """Let a folder of the path say that a package is installed."""
    info = folder / "press_kit-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: press-kit\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(entries)


def test_it_is_recorded_under_the_names_that_find_it_again(recorded):
    (row,), frames = read_episodes(recorded), read_frames(recorded, 0)
    settings = json.loads(row["settings"])
    assert row["success"]
    assert [settings[flag[2:]] for flag in NAMED] == list(NAMED.values())
    assert (row["environment"], row["mode"]) == ("press_kit:PRESS", "press_kit:HAND")
    assert set(frames["teleop.mode"]) == {"press_kit:HAND"}
    assert row["tasks"] == ["Press the button."]


@pytest.mark.parametrize("missing", NAMED)
def test_a_dataset_alone_imports_nothing(missing, recorded, unseen):
    """Whatever of it the command line does not say too is refused, by the flag to say."""
    words = said(*(NAMED.keys() - {missing}))
    refused(recorded, *words, name="replay", told=f"{missing} {NAMED[missing]}")
    assert unseen()


def test_it_is_replayed(recorded):
    assert "0.00e+00" in ran(recorded, *SAID, name="replay")


@pytest.mark.parametrize("missing", ["--task", "--mode", "--robot"])
def test_a_policy_alone_imports_nothing(missing, trained, unseen):
    flags = {"--task", "--mode", "--robot"} - {missing}
    refused(trained, *said(*flags), "--episodes", 1, name="evaluate", told=f"{missing} {NAMED[missing]}")
    assert unseen()


def test_a_policy_trained_on_its_data_is_evaluated(trained, tmp_path):
    flags = [*said("--task", "--mode", "--robot"), "--episodes", 1, "--time_limit", 0.5, "--workers", 1]
    ran(trained, *flags, "--json", tmp_path / "e.json", name="evaluate")
    content = json.loads((tmp_path / "e.json").read_text())
    assert content["task"] == "press_kit:PRESS"
    assert list(content["arms"]) == ["press_kit:HAND intent"]


def test_an_installed_entry_is_listed_recorded_and_found_again(installed, tmp_path, unseen):
    shown = " ".join(word for word in ran("--help").split() if word != "│")
    assert "; press; or module:name" in shown
    assert unseen()  # the help imports nothing
    ran(tmp_path / "set", "--task", "press", "--dataset.num_episodes", 1, "--time_limit", 0.5)
    ran(tmp_path / "set", name="replay")


def test_an_entry_with_the_name_of_one_of_handrail_is_not_taken_for_it(tmp_path, monkeypatch):
    install(tmp_path, "[handrail.modes]\nrl = press_kit:HAND\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert MODES["rl"].controller == "rl"


def test_a_policy_that_names_a_module_is_evaluated_beside_one_of_a_mode(trained, tmp_path):
    own = tmp_path / "own"
    shutil.copytree(trained, own)
    for path in own.rglob(NAME):
        path.write_text(path.read_text().replace("press_kit:HAND", "ee"))
    config = EvaluateConfig(policy=(str(trained), str(own)), mode="press_kit:HAND", robot="press_kit:TWIN")
    found, refused = policy_conditions(replace(config, task="press_kit:PRESS"))
    assert (len(found), refused) == (2, [])


def test_a_metric_of_an_installed_package_is_in_the_report(recorded, tmp_path):
    install(tmp_path, "[handrail.metrics]\npresses = kit_metrics:presses\n")
    (tmp_path / "kit_metrics.py").write_text(METRIC)
    other = shutil.copytree(recorded, tmp_path / "other")
    program = [sys.executable, "-m", "handrail.scripts", "compare"]
    command = [*program, recorded, other, "--output", tmp_path / "report"]
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    subprocess.run([*map(str, command)], env=environment, check=True, capture_output=True)
    values = json.loads((tmp_path / "report" / "report.json").read_text())["values"]
    own, ours = ([each for each in values if each["metric"] == name] for name in ("presses", "length"))
    assert [each["estimate"] for each in own] == [each["estimate"] for each in ours]
    assert own
    assert "how long the press took" in (tmp_path / "report" / "report.html").read_text()


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--task", "press"], "unknown task 'press': expected one of carry_box, drawer"),
        (["--task", "nowhere.press:PRESS"], "task nowhere.press:PRESS: cannot import it: No module named"),
        (["--task", "press_kit:PULL"], "task press_kit:PULL: cannot import it: module 'press_kit' has no"),
        (["--task", "press_kit:HAND"], "task press_kit:HAND: expected a TaskSpec, got a TeleopMode"),
        (["--robot", "press_kit:PRESS"], "robot press_kit:PRESS: expected a RobotSpec, got a TaskSpec"),
    ],
)
def test_a_missing_name_is_one_line(flags, words, tmp_path):
    refused(tmp_path / "set", *flags, told=words)
    assert not (tmp_path / "set").exists()


def test_a_study_s_file_imports_nothing(unseen):
    task = TaskDesign(episodes=2, minutes=1.0)
    design = StudyDesign("mine", ("ee", "direct"), {"reach": task}, "ee")
    design.check()
    for other in (replace(design, modes=("ee", NAMED["--mode"])), replace(design, tasks={PRESS.name: task})):
        with pytest.raises(HandrailError, match="unknown"):
            other.check()
    assert unseen()
