"""A study does every job once, goes on where it was, and reports what is there."""

import dataclasses
import json
import multiprocessing
from pathlib import Path

import numpy as np
import pytest
from datasets_helpers import create, frame_of

from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.evaluations import FORMAT
from handrail.policies.study.config import StudyConfig
from handrail.policies.study.design import design_names, load_design
from handrail.policies.study.jobs import Layout, jobs
from handrail.policies.study.notes import read_json, write_json
from handrail.policies.study.run import run_study
from handrail.policies.study.work import begin, fingerprint
from handrail.scripts.study import main

DESIGN = """
modes = ["ee", "direct"]
baseline = "direct"
seeds = [0, 1]
rollouts = 10
[tasks.reach]
episodes = 5
minutes = 0.1
steps = 10
[robustness]
perturbations = ["push"]
protections = ["filter"]
rollouts = 5
seeds = [0, 1]
[sweep]
tasks = ["reach"]
noises = [0.0]
seeds = [0]
"""


@pytest.fixture
def preset(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(DESIGN)
    return str(path)


def make(job, design, layout):
    """Leave the files that a job leaves, made up: the better the operator, the better the policy."""
    if job.cell:
        with create(layout.dataset(job.cell)) as writer:
            for episode in range(6):
                for index in range(12):
                    writer.add_frame(frame_of(episode, index, cameras=False), "reach")
                writer.save_episode({"success": episode > 0, "failure_reason": "timeout", "seed": episode})
    if job.arm:
        rng = np.random.default_rng(job.arm.seed)
        share = 0.9 if job.arm.cell.mode == "ee" else 0.3
        for what, ending in (("nominal", ""), ("disturbed", " pushed"), ("protected", " filter")):
            if what == "nominal" or job.robust:
                rollouts = [
                    {"seed": seed, "success": bool(rng.random() < share), "contacts": seed % 2, "length": 3.0}
                    for seed in range(40)
                ]
                entry = {"training_seed": job.arm.seed, "rollouts": rollouts}
                arms = {job.arm.label + ending: [entry]}
                write_json(layout.evaluation(job.arm, what), {"format": FORMAT, "arms": arms})
    write_json(layout.done(job), {"settings": fingerprint(job, design), "result": {}, "seconds": 0.0})


class Starter:
    """Begins jobs that only leave their files, and remembers which."""

    def __init__(self, failing=""):
        self.begun, self.failing = [], failing

    def __call__(self, job, design, layout):
        needed = [layout.root / "done" / f"{name}.json" for name in job.needs]
        assert all(path.is_file() for path in needed), f"{job.name} began before what it needs"
        self.begun.append(job.name)
        if job.name != self.failing:
            make(job, design, layout)
        process = multiprocessing.get_context("fork").Process(target=exit, args=(job.name == self.failing,))
        process.start()
        return process


def test_every_job_once_then_none_again(tmp_path, preset):
    config = StudyConfig(preset, str(tmp_path / "study"), workers=3)
    first, second = Starter(), Starter()
    assert run_study(config, first) == 0
    assert sorted(first.begun) == sorted(job.name for job in jobs(load_design(preset)))
    assert len(set(first.begun)) == len(first.begun)
    assert run_study(config, second) == 0
    assert second.begun == []


def test_changed_settings_are_done_again_and_nothing_else(tmp_path, preset):
    config = StudyConfig(preset, str(tmp_path / "study"))
    assert run_study(config, Starter()) == 0
    Path(preset).write_text(DESIGN.replace("steps = 10", "steps = 20"))
    again = Starter()
    assert run_study(config, again) == 0
    expected = [job.name for job in jobs(load_design(preset)) if job.kind != "collect"]
    assert sorted(again.begun) == sorted(expected)


def test_what_other_settings_made_is_removed(tmp_path, preset):
    design, layout = load_design(preset), Layout(tmp_path / "study")
    job = next(each for each in jobs(design) if each.arm)
    begin(job, design, layout)
    model = layout.policy(job.arm) / "model"
    write_json(model, {})
    begin(job, design, layout)
    assert model.is_file(), "the same settings: training goes on"
    begin(job, dataclasses.replace(design, rollouts=11), layout)
    assert not model.exists()


def test_a_failure_stops_only_what_needs_it(tmp_path, preset, capsys):
    config = StudyConfig(preset, str(tmp_path / "study"))
    starter = Starter(failing="collect/reach/direct")
    assert run_study(config, starter) == 1
    done = {
        path.relative_to(tmp_path / "study/done").with_suffix("").as_posix()
        for path in (tmp_path / "study/done").rglob("*.json")
    }
    assert "policy/reach/ee/intent-time-1" in done
    assert not any("reach/direct/" in name for name in done)
    assert "collect/reach/direct" in capsys.readouterr().err
    assert run_study(config, Starter()) == 0


def test_report_says_what_is_in_the_files(tmp_path, preset):
    page = tmp_path / "page.md"
    page.write_text("# Ours\n\nBefore.\n\n<!-- study small -->\nold\n<!-- end of study small -->\n\nAfter.\n")
    config = StudyConfig(preset, str(tmp_path / "study"), page=str(page))
    assert run_study(config, Starter()) == 0
    content = json.loads((tmp_path / "study/study.json").read_text())
    arms = {arm["label"]: arm for arm in content["tasks"]["reach"]["policies"]["arms"]}
    assert set(arms) == {"ee", "ee intent", "direct"}
    assert all(arm["rollouts"] == 80 for arm in arms.values())
    (ee,) = [d for d in content["tasks"]["reach"]["policies"]["differences"] if d["label"] == "ee"]
    assert ee["rollouts"]["estimate"] == pytest.approx(
        (arms["ee"]["successes"] - arms["direct"]["successes"]) / 80
    )
    assert set(content["tasks"]["reach"]["disturbed"]) == {f"{label} pushed" for label in arms}
    assert content["tasks"]["reach"]["disturbed"]["ee pushed"]["touched"] == pytest.approx(0.5)
    assert [point["noise"] for point in content["tasks"]["reach"]["sweep"]["ee"]] == [0.0, 1.0]
    text = page.read_text()
    assert text.startswith("# Ours\n\nBefore.")
    assert text.endswith("After.\n")
    assert "old" not in text
    assert f"{arms['direct']['successes']} of 80" in text
    assert (tmp_path / "page_small_answer.png").read_bytes().startswith(b"\x89PNG")
    html = (tmp_path / "study/report.html").read_text()
    assert f"{arms['ee intent']['successes']} of 80" in html


def test_report_of_a_study_that_has_hardly_begun(tmp_path, preset):
    config = StudyConfig(preset, str(tmp_path / "study"), report_only=True)
    assert run_study(config, Starter()) == 0
    assert (tmp_path / "study/report.html").is_file()


@pytest.mark.parametrize("name", design_names())
def test_presets_are_whole(name):
    design = load_design(name)
    names = [job.name for job in jobs(design)]
    assert len(set(names)) == len(names)
    assert {need for job in jobs(design) for need in job.needs} <= set(names)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("steps = 10", "stepz = 10"), "stepz"),
        (("steps = 10", 'steps = "many"'), "many"),
        (('"direct"]', '"psychic"]'), "unknown mode 'psychic'"),
        (('baseline = "direct"', 'baseline = "leader"'), "unknown baseline 'leader'"),
        (("[tasks.reach]", "[tasks.dance]"), "unknown task"),
        (("minutes = 0.1", ""), "needs minutes"),
        (("seeds = [0, 1]", "seeds = [0, 0]"), "seeds"),
        (("[tasks.reach]", "[tasks.reach"), "expected TOML"),
    ],
)
def test_a_wrong_design_is_one_line(tmp_path, change, words):
    path = tmp_path / "wrong.toml"
    path.write_text(DESIGN.replace(*change))
    with pytest.raises(HandrailError, match=words) as raised:
        load_design(str(path))
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--preset", "huge"], "unknown study 'huge'"),
        (["--workers", "0"], "--workers 0"),
        (["--page", "nowhere/page.md"], "--page"),
    ],
)
def test_wrong_flags_are_one_line(flags, words, monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["handrail-study", *flags])
    with pytest.raises(SystemExit) as stop:
        main()
    assert stop.value.code == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1


def test_notes_are_whole_or_not_there(tmp_path):
    path = tmp_path / "a" / "note.json"
    assert read_json(path) == {}
    write_json(path, {"a": 1})
    assert read_json(path) == {"a": 1}
    path.write_text('{"a": ')
    assert read_json(path) == {}
