"""Whatever is wrong with a study is one line, before the first recording begins."""

import contextlib
import dataclasses
from pathlib import Path

import pytest
from command_helpers import refused
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from study_helpers import DESIGN, Starter, run_here
from toml_helpers import mutated, spoilt

from handrail.controllers.errors import HandrailError
from handrail.datasets.storage.lock import FolderLock
from handrail.policies.study import design as design_module
from handrail.policies.study.config import StudyConfig
from handrail.policies.study.design import (
    Beside,
    DeclaredPair,
    Robustness,
    Rounds,
    StudyDesign,
    TaskDesign,
    Way,
)
from handrail.policies.study.settings import load_design

SHOWN = ("\n", " = "), ("[", ""), ("[rounds.", ".")
FRACTIONS = ("margin = 10", "margin = -0.1", "margin = nan", "sd = 1e200", "sd = nan", "sd = -5.0")
PAIR, TURNED = "[[pairs]]\none = 'ee'\nother = 'direct'\n", "[[pairs]]\none = 'direct'\nother = 'ee'\n"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("steps = 10", "stepz = 10"), "stepz"),
        (("steps = 10", 'steps = "many"'), "many"),
        (('"direct"]', '"psychic"]'), "unknown mode 'psychic'"),
        (('baseline = "direct"', 'baseline = "leader"'), "unknown baseline 'leader'"),
        (("[tasks.reach]", "[tasks.dance]"), "unknown task"),
        (("minutes = 0.1", ""), "minutes"),
        (("minutes = 0.1", "minutes = 0"), "minutes: expected a number > 0.0, got 0"),
        (("draws = 2", "draws = 0"), "draws: expected a whole number >= 1, got 0"),
        (("minutes = 0.1", "minutes = nan"), "minutes: expected a number > 0.0, got nan"),
        (("minutes = 0.1", "minutes = 0.1\nrollout_limit = -1.0"), "time_limit: expected a number >= 0"),
        (("minutes = 0.1", "minutes = 0.1\nbatch_size = -4"), "batch_size: expected a whole number >= 0"),
        (('intents = ["ee"]', 'intents = ["direct"]'), "unknown mode of intents, which the MPC completes"),
        (("[beside]", '[beside]\ntargets = ["direct"]'), "targets"),
        (("[beside]", "[factors]\nhand_mpc = 'ee'\n[beside]"), "factors"),
        (("[beside]", PAIR.replace("direct", "leader") + "[beside]"), "unknown mode of a pair 'leader'"),
        (("[beside]", PAIR.replace("one", "own") + "[beside]"), "own"),
        (("[beside]", PAIR.replace("direct", "ee") + "[beside]"), "pairs: expected two modes each, once"),
        (("[beside]", 2 * PAIR + "[beside]"), "pairs: expected two modes each, once"),
        (
            ("[beside]", PAIR + "budget = 'number'\n[beside]"),
            "unknown mode of a pair by number, which same_number has in all draws 'ee'",
        ),
        (
            ("rollouts = 40", "rollouts = 40\ncurve = [4, 6]"),
            "curve expected multiples of the first below 10",
        ),
        (
            ("rollouts = 40", "rollouts = 40\ncurve = [5, 10]"),
            "curve expected multiples of the first below 10",
        ),
        (("minutes = 0.1", "minutes = 0.1\nsizes = [0.05, 0.05]"), "sizes of reach: expected each once"),
        (("minutes = 0.1", "minutes = 0.1\nsizes = [0.1]"), "between 0 and its 0.1 minutes"),
        (('"direct"]', '"direct", "ee_and_psychic"]'), "unknown mode 'psychic'"),
        (("[beside]", "[beside]\nnumbered = ['leader']"), "same_number"),
        (("rollouts = 40", "rollouts = 2000000"), "--episodes: expected a whole number"),
        (('["push"]', '["pusch"]'), "pusch"),
        (('["push"]\nprotections = ["filter"]', "[]\nprotections = []"), "robustness expected some"),
        (('["filter"]', '["fltr"]'), "unknown protection 'fltr'"),
        (("rollouts = 20\ndraws = 2", "draws = 3"), "robustness.draws expected at most 2 draws"),
        (('["push"]', '["none", "push"]'), "robustness: expected what changes something, got none"),
        (('["filter"]', '["own"]'), "robustness: expected what changes something, got own"),
        (('["push"]', '["push", "blank"]'), "perturbations: expected encoders for blank:1, got none"),
        (('"direct"]', '"direct", "direct_and_both"]'), "mode both: expected a robot with 2 hands"),
        (('"direct"]', '"direct", "both"]'), "mode both: expected a robot with 2 hands"),
        (("[beside]", PAIR + TURNED + "[beside]"), "pairs: expected two modes each, once"),
        *((("[beside]", f"{PAIR}{entry}\n[beside]"), entry.split()[0]) for entry in FRACTIONS),
        (("draws = 2", "draws = 2020-01-01"), "draws"),
        (("draws = 2", "draws = 2\nwhen = 07:32:00"), "when"),
        (("[tasks.reach]", "[tasks.reach"), "not valid TOML"),
        (("draws = 2", 'draws = 2\ndigest = "0"'), "digest"),
        (("[beside]", "[[beside]]"), "beside"),
        (('intents = ["ee"]', 'intents = "ee"'), "intents"),
        (('baseline = "direct"', 'baseline = "direct"\nname = "../x"'), "name"),
    ],
)
def test_a_wrong_design_is_one_line(tmp_path, change, words):
    path = tmp_path / "wrong.toml"
    path.write_text(DESIGN.replace(*change))
    with pytest.raises(HandrailError, match=words):
        load_design(str(path))


def test_a_policy_that_cannot_be_built_is_known_before_anything_begins(tmp_path, preset):
    Path(preset).write_text(DESIGN.replace('baseline = "direct"', 'baseline = "direct"\npolicy = "atc"'))
    starter = Starter()
    with pytest.raises(HandrailError, match="expected one of act"):
        run_here(StudyConfig(preset, str(tmp_path / "study")), starter)
    assert starter.begun == []


def test_every_setting_of_a_design_is_explained_where_people_look():
    written = design_module.__doc__ or ""
    for kind in (StudyDesign, TaskDesign, DeclaredPair, Beside, Robustness, Rounds, Way):
        for entry in dataclasses.fields(kind):
            described = any(f"{mark}{entry.name}{end}" in written for mark, end in SHOWN)
            assert described or entry.name in ("name", "digest"), entry.name


def test_a_failed_job_is_told_by_what_it_said_this_time(tmp_path, preset, capsys):
    log = tmp_path / "study/logs/collect/reach/ee/0.log"
    log.parent.mkdir(parents=True)
    log.write_text("error: disk full, last week\n")
    assert run_here(StudyConfig(preset, str(tmp_path / "study")), Starter(failing="collect/reach/ee/0")) == 1
    done = {path.relative_to(tmp_path / "study/done").as_posix() for path in tmp_path.rglob("done/**/*.json")}
    assert {"collect/reach/ee/1.json", "policy/reach/ee/1/realised-time.json"} <= done
    assert not any("reach/ee/0" in name for name in done)
    said = capsys.readouterr().err.replace("\n", " ")
    assert "failed: collect/reach/ee/0: of today" in said
    assert "failed: policy/reach/ee/0/realised-time: a job that it needs failed" in said
    assert "last week" not in said


@pytest.mark.parametrize("marks", ["{0}\nold", "old\n{1}", "{1}\nold\n{0}", "{0}\n{0}\n{1}", "{0}\n{1}\n{1}"])
def test_a_page_whose_marks_are_no_pair_is_left_alone_before_anything_begins(marks, tmp_path, preset):
    page, starter = tmp_path / "page.md", Starter()
    text = (
        "# Ours\n" + marks.format("<!-- study small -->", "<!-- end of study small -->") + "\nMy own words.\n"
    )
    page.write_text(text)
    with pytest.raises(HandrailError, match="--page: expected"):
        run_here(StudyConfig(preset, str(tmp_path / "study"), page=str(page)), starter)
    assert page.read_text() == text
    assert starter.begun == []


@pytest.mark.parametrize("place", ["file", "file/below", "/proc/nope"])
def test_a_folder_that_cannot_be_is_one_line(place, tmp_path, preset):
    (tmp_path / "file").touch()
    with pytest.raises(HandrailError, match=r"--output .*: expected a folder"):
        run_here(StudyConfig(preset, str(tmp_path / place)), Starter())


def test_a_second_study_in_a_folder_is_told_what_the_first_is(tmp_path, preset):
    lock = FolderLock(tmp_path / "study" / ".study")
    try:
        with pytest.raises(HandrailError, match=r"study .* another handrail-study"):
            run_here(StudyConfig(preset, str(tmp_path / "study")), Starter())
    finally:
        lock.release()


@pytest.mark.parametrize("missing", ["torch", "accelerate"])
def test_a_missing_package_is_named_before_anything_begins(missing, tmp_path, preset, monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: name != missing or None)
    starter = Starter()
    with pytest.raises(HandrailError, match=f"handrail-study: expected {missing}"):
        run_here(StudyConfig(preset, str(tmp_path / "study")), starter)
    assert starter.begun == []
    (tmp_path / "study" / "begun").mkdir(parents=True)
    if missing == "accelerate":  # nothing is trained
        assert run_here(StudyConfig(preset, str(tmp_path / "study"), report_only=True), starter) == 0


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--preset", "huge"], "unknown study 'huge'"),
        (["--workers", "-1"], "--workers -1"),
        (["--page", "nowhere/page.md"], "--page"),
    ],
)
def test_wrong_flags_are_one_line(flags, words, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    refused(*flags, name="study", told=words)


QUICK = settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])


def one_line_or_a_design(path) -> None:
    with contextlib.suppress(HandrailError):  # which is one line
        load_design(str(path))


@given(data=st.data())
@QUICK
def test_an_entry_of_another_kind_is_one_line(tmp_path, data):
    path = tmp_path / "study.toml"
    path.write_text(mutated(DESIGN, data))
    one_line_or_a_design(path)


@given(data=st.data())
@QUICK
def test_another_text_is_one_line(tmp_path, data):
    path = tmp_path / "study.toml"
    path.write_bytes(spoilt(DESIGN, data, 20))
    one_line_or_a_design(path)


@pytest.mark.parametrize(
    "content",
    [b"\xff\xfe", b"", b"a = " + b"[" * 100_000, b"a = " + b"9" * 10_000, b"#" * 2**21],
    ids=["bytes", "empty", "deep", "digits", "large"],
)
def test_a_file_that_is_no_design_is_one_line(content, tmp_path):
    path = tmp_path / "study.toml"
    path.write_bytes(content)
    refused("--preset", path, "--output", tmp_path / "study", name="study")
    assert not (tmp_path / "study").exists()
