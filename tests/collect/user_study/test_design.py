"""A study's file is checked whole where it enters: one line that says what is wrong."""

import json
import re
import tomllib
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
from user_study_helpers import study_folder

from handrail.collect.user_study import design, run
from handrail.collect.user_study.conduct import Ending
from handrail.collect.user_study.config import StudySessionConfig
from handrail.collect.user_study.design import UserStudy
from handrail.collect.user_study.folder import StudyFolder
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.description import load_description
from handrail.controllers.typed import decoded

GOOD = {"title": "t", "consent": "c", "modes": ["ee", "direct"], "tasks": ["reach"]}
LIKERT = {"name": "trust", "text": "?", "kind": "likert"}
NUMBER = LIKERT | {"kind": "number"}
WRONG = {
    "no title": ({"title": None}, "expected an entry 'title'"),
    "unknown": ({"trails": 3}, "unknown entry 'trails'", "nearest: trials"),
    "no mode": ({"modes": []}, "expected one or more of each"),
    "mode": ({"modes": ["ee", "telepathy"]}, "unknown mode 'telepathy': expected one of base"),
    "module": ({"modes": ["os:system"]}, "unknown mode"),
    "twice": ({"modes": ["ee", "ee"]}, "mode: expected each once"),
    "task": ({"tasks": ["juggle"]}, "unknown task"),
    "robot": ({"robot": "spot"}, "unknown robot 'spot'"),
    "robot file": ({"robot": "my:ROBOT"}, "unknown robot"),
    "form": ({"forms": ["nasa"]}, "unknown form 'nasa': expected one of questions, sus, tlx, tlx_raw"),
    "both tlx": ({"forms": ["tlx", "tlx_raw"]}, "expected tlx or tlx_raw"),
    "trials": ({"trials": 0}, "trials: expected", ">= 1", "got 0"),
    "flag": ({"demo": "yes"}, "demo: expected true or false"),
    "fps": ({"fps": 5}, "expected 10 to 100"),
    "camera": ({"cameras": ["roof"]}, "unknown camera 'roof'"),
    "time": ({"time_limit": float("nan")}, "time_limit"),
    "allow": ({"allow": ["fly"]}, "unknown allow"),
    "practice": ({"practice": {"sucesses": 2}}, "practice: unknown entry 'sucesses'", "nearest: successes"),
    "instructions": ({"instructions": {"base": "x"}}, "unknown mode in [instructions]"),
    "questions unused": ({"questions": [LIKERT]}, "expected 'questions' among them exactly if"),
    "questions missing": ({"forms": ["questions"]}, "expected 'questions' among them exactly if"),
    "name": ({"questions": [LIKERT | {"name": "a b"}]}, "questions[0]", "expected letters, digits and _"),
    "kind": ({"questions": [LIKERT | {"kind": "oracle"}]}, "questions[0]: kind", "expected one of likert"),
    "choices": ({"questions": [LIKERT | {"kind": "choice", "choices": ["a"]}]}, "two or more"),
    "points": ({"questions": [LIKERT | {"points": 99}]}, "points: expected", "<= 21"),
    "of another kind": ({"questions": [LIKERT | {"choices": ["a", "b"]}]}, "choices: expected only of kind"),
    "zero of another kind": ({"questions": [LIKERT | {"least": 0}]}, "least: expected only of kind"),
    "when": ({"questions": [LIKERT | {"when": "never"}]}, "expected one of condition, start, end"),
    "least": ({"questions": [NUMBER | {"least": 9, "most": 1}]}, "expected least < most"),
    "control letters": ({"consent": "a\x1b[2J"}, "consent: expected a text"),
}


def test_the_example_names_every_camera_of_its_robot():
    source = (Path(design.__file__).parent / "example.toml").read_text()
    (said,) = re.findall(r"^cameras = .*?# (.*)$", source, re.MULTILINE)
    cameras = load_description(tomllib.loads(source)["robot"]).camera_names
    assert {*re.findall('"(.*?)"', said)} == {*cameras}


@pytest.mark.parametrize("case", WRONG)
def test_faults_are_said_in_one_line(case):
    changes, *words = WRONG[case]
    content = {name: value for name, value in (GOOD | changes).items() if value is not None}
    with pytest.raises(HandrailError) as told:
        decoded(content, UserStudy, "study x.toml")
    for word in (*words, "study x.toml"):
        assert word in str(told.value)


def test_the_example_is_a_study_and_explains_every_entry(tmp_path):
    path = StudyFolder(tmp_path).write_example()
    study = StudyFolder(tmp_path).study
    assert len(study.modes) == 3
    assert {question.kind for question in study.questions} == {"likert", "number", "choice", "text"}
    said = tomllib.loads(path.read_text())
    assert set(said) == set(study.__dataclass_fields__)
    with pytest.raises(HandrailError, match="found a study"):
        StudyFolder(tmp_path).write_example()


def test_a_study_that_has_begun_stays_as_it_is(tmp_path):
    folder = StudyFolder(tmp_path)
    path = folder.write_example()
    folder.freeze()
    assert StudyFolder(tmp_path).study == folder.study
    path.write_text(path.read_text().replace("trials = 3", "trials = 4"))
    with pytest.raises(HandrailError, match="it was changed after"):
        _ = StudyFolder(tmp_path).study
    path.unlink()
    assert StudyFolder(tmp_path).study == folder.study


def test_a_participant_under_other_versions_is_said(tmp_path, monkeypatch, capsys):
    def no_page(*_):
        raise HandrailError("no page here")

    monkeypatch.setattr(run, "open_server", no_page)
    study_folder(tmp_path).freeze()
    for changed in ({}, {"numpy": "1.2.3"}):
        frozen = json.loads((tmp_path / "study.json").read_text())
        frozen["versions"] |= changed
        (tmp_path / "study.json").write_text(json.dumps(frozen))
        with pytest.raises(HandrailError, match="no page here"):
            run.study_session(StudySessionConfig("run", str(tmp_path), "P001"))
        said = " ".join(capsys.readouterr().err.split())
        expected = f"other versions than at the study's beginning: numpy {np.__version__} (was 1.2.3)"
        assert (expected in said) == ("other versions" in said) == bool(changed)


def ran(monkeypatch, folder, what, at_close=None):
    """Run a session whose conductor says or raises something; so may the end of its server."""

    class Fake:
        def __init__(self, *_):
            self.pipe = self

        def run(self):
            if isinstance(what, BaseException):
                raise what
            return what

        def send_surely(self, *_):
            pass

        def close(self):
            if at_close:
                raise at_close

    for name in ("open_server", "Conductor", "Cards"):
        monkeypatch.setattr(run, name, Fake)
    monkeypatch.setattr(run, "Driving", lambda *_: nullcontext())
    run.study_session(StudySessionConfig("run", str(folder), "P001"))


def test_a_refusal_that_is_interrupted_leaves_nothing(tmp_path, monkeypatch):
    study_folder(tmp_path).freeze()
    with pytest.raises(KeyboardInterrupt):
        ran(monkeypatch, tmp_path, Ending.REFUSED, at_close=KeyboardInterrupt())
    assert not list((tmp_path / "participants").iterdir())


def test_an_interrupt_leaves_tables_of_all_that_was_said(tmp_path, monkeypatch):
    study_folder(tmp_path).freeze()
    with pytest.raises(KeyboardInterrupt):
        ran(monkeypatch, tmp_path, KeyboardInterrupt())
    assert (tmp_path / "exports" / "scores.csv").exists()


def test_without_the_extra_no_study_begins(tmp_path, monkeypatch):
    monkeypatch.setattr(run, "NEEDED", ("the cockpit", ("no_such_package",), "cockpit"))
    study_folder(tmp_path).freeze()
    with pytest.raises(HandrailError, match="no_such_package"):
        ran(monkeypatch, tmp_path, Ending.DONE)
    assert not (tmp_path / "participants" / "P001").exists()
