"""What another package adds is recorded, replayed, trained on and evaluated; no file makes it be imported."""

import json
import sys
from dataclasses import replace

import pytest
from command_helpers import command
from press_kit import PRESS
from training_helpers import TINY

from handrail.controllers.errors import HandrailError
from handrail.datasets.reading.reader import read_episodes, read_frames
from handrail.policies.study.design import StudyDesign, TaskDesign

NAMED = {
    flag: f"press_kit:{entry}"
    for flag, entry in {"--task": "PRESS", "--mode": "HAND", "--operator": "EXACT", "--robot": "TWIN"}.items()
}
SAID = [word for pair in NAMED.items() for word in pair]


def said(*flags):
    return [word for flag in flags for word in (flag, NAMED[flag])]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    root = tmp_path_factory.mktemp("press") / "set"
    done = command(root, *SAID, "--dataset.num_episodes", 1)
    assert done.returncode == 0, done.stderr
    return root


@pytest.fixture(scope="module")
def trained(recorded, tmp_path_factory):
    """A policy that nobody trained for long on that dataset."""
    folder = tmp_path_factory.mktemp("press_policy") / "act"
    words = f"--output {folder} --actions intent --steps 2 --batch_size 4 --policy_options".split()
    done = command(recorded, *said("--mode"), *words, *TINY, name="train")
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture
def unseen(monkeypatch):
    """The package as it is before anybody imports it."""
    monkeypatch.delitem(sys.modules, "press_kit")
    return lambda: "press_kit" not in sys.modules


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """A package that is installed and declares the task as an entry point."""
    info = tmp_path / "press_kit-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: press-kit\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[handrail.tasks]\npress = press_kit:PRESS\n")
    monkeypatch.syspath_prepend(tmp_path)


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
    done = command(recorded, *said(*(NAMED.keys() - {missing})), name="replay")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert f"{missing} {NAMED[missing]}" in done.stderr
    assert unseen()


def test_it_is_replayed(recorded):
    done = command(recorded, *SAID, name="replay")
    assert done.returncode == 0, done.stderr
    assert "0.00e+00" in done.stdout


@pytest.mark.parametrize("missing", ["--task", "--mode", "--robot"])
def test_a_policy_alone_imports_nothing(missing, trained, unseen):
    flags = {"--task", "--mode", "--robot"} - {missing}
    done = command(trained, *said(*flags), "--episodes", 1, name="evaluate")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert f"{missing} {NAMED[missing]}" in done.stderr
    assert unseen()


def test_what_was_trained_on_it_is_evaluated(trained, tmp_path):
    flags = [*said("--task", "--mode", "--robot"), "--episodes", 1, "--time_limit", 0.5, "--workers", 1]
    done = command(trained, *flags, "--json", tmp_path / "e.json", name="evaluate")
    assert done.returncode == 0, done.stderr
    content = json.loads((tmp_path / "e.json").read_text())
    assert content["task"] == "press_kit:PRESS"
    assert list(content["arms"]) == ["press_kit:HAND intent"]


def test_an_installed_entry_is_listed_recorded_and_found_again(installed, tmp_path, unseen):
    assert "; press; or module:name" in " ".join(
        word for word in command("--help").stdout.split() if word != "│"
    )
    assert unseen()  # the help imports nothing
    words = ["--task", "press", "--dataset.num_episodes", 1, "--time_limit", 0.5]
    done = command(tmp_path / "set", *words)
    assert done.returncode == 0, done.stderr
    assert command(tmp_path / "set", name="replay").returncode == 0


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--task", "press"], "unknown task 'press': expected one of drawer, pick_place, reach, tray"),
        (["--task", "nowhere.press:PRESS"], "task nowhere.press:PRESS: cannot import it: No module named"),
        (["--task", "press_kit:PULL"], "task press_kit:PULL: cannot import it: module 'press_kit' has no"),
        (["--task", "press_kit:HAND"], "task press_kit:HAND: expected a TaskSpec, got a TeleopMode"),
        (["--robot", "press_kit:PRESS"], "robot press_kit:PRESS: expected a RobotSpec, got a TaskSpec"),
    ],
)
def test_what_is_not_there_is_one_line(flags, words, tmp_path):
    done = command(tmp_path / "set", *flags)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert words in done.stderr
    assert not (tmp_path / "set").exists()


def test_a_study_s_file_imports_nothing(unseen):
    task = TaskDesign(episodes=2, minutes=1.0)
    design = StudyDesign("mine", ("ee", "direct"), {"reach": task}, "ee")
    design.check()
    for other in (replace(design, modes=("ee", NAMED["--mode"])), replace(design, tasks={PRESS.name: task})):
        with pytest.raises(HandrailError, match="unknown"):
            other.check()
    assert unseen()
