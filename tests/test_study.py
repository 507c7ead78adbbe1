"""A study does every job once, goes on where it was, and reports what is there."""

import dataclasses
import json
import multiprocessing
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from datasets_helpers import create, frame_of

from handrail.controllers.errors import HandrailError
from handrail.datasets.comparison.evaluations import FORMAT
from handrail.datasets.lock import DatasetLock
from handrail.policies.imitation import presets
from handrail.policies.study import design as design_module
from handrail.policies.study.config import StudyConfig
from handrail.policies.study.design import Robustness, StudyDesign, Sweep, TaskDesign
from handrail.policies.study.jobs import Layout, jobs
from handrail.policies.study.load import design_names, load_design
from handrail.policies.study.marks import between_marks
from handrail.policies.study.notes import read_json, write_json
from handrail.policies.study.run import _last_words, _mark, run_study
from handrail.policies.study.settings import evaluations, fingerprint
from handrail.policies.study.standing import Standing, is_done
from handrail.policies.study.work import begin
from handrail.scripts.study import main

DESIGN = """
modes = ["ee", "direct"]
baseline = "direct"
seeds = [0, 1]
rollouts = 40
[tasks.reach]
episodes = 5
minutes = 0.1
steps = 10
[robustness]
perturbations = ["push"]
protections = ["filter"]
rollouts = 20
seeds = [0, 1]
[sweep]
tasks = ["reach"]
noises = [0.0]
seeds = [0]
"""


@pytest.fixture(autouse=True)
def impatient(monkeypatch):
    """Made-up jobs end at once: look at them more often than at real ones."""
    monkeypatch.setattr("handrail.policies.study.run._ASLEEP", 0.005)


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
        write_json(layout.policy(job.arm) / "checkpoints/000010/pretrained_model/handrail.json", {})
        for what, config in evaluations(job, design).items():
            rollouts = [
                {"seed": seed, "success": bool(rng.random() < share), "contacts": seed % 2, "length": 3.0}
                for seed in config.seeds
            ]
            ending = {"nominal": "", "disturbed": " pushed", "protected": " filter"}[what]
            entry = {"training_seed": job.arm.seed, "rollouts": rollouts}
            arms = {job.arm.label + ending: [entry]}
            write_json(layout.evaluation(job.arm, what), {"format": FORMAT, "arms": arms})
    if job.task:
        write_json(layout.comparison(job.task) / "report.html", {})
    result = {"episodes": 6} if job.cell else {}
    write_json(layout.begun(job), fingerprint(job, design))
    write_json(layout.done(job), {"settings": fingerprint(job, design), "result": result, "seconds": 0.0})


class Ended:
    """What is left of a process that did its job."""

    exitcode = 0

    def is_alive(self):
        return False


class Starter:
    """Begins jobs that only leave their files, and remembers which; one may fail, as a real process."""

    def __init__(self, failing=""):
        self.begun, self.failing = [], failing

    def __call__(self, job, design, layout):
        needed = [layout.root / "done" / f"{name}.json" for name in job.needs]
        assert all(path.is_file() for path in needed), f"{job.name} began before what it needs"
        self.begun.append(job.name)
        if job.name != self.failing:
            make(job, design, layout)
            return Ended()
        process = multiprocessing.get_context("spawn").Process(target=sys.exit, args=(1,))
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


def everything(tmp_path, preset):
    """Return the design, layout and jobs of a study of which every job is done."""
    design, layout = load_design(preset), Layout(tmp_path / "study")
    for job in jobs(design):
        make(job, design, layout)
    return design, layout, jobs(design)


def changed(design, **settings):
    """Return a design with other settings of its task."""
    return dataclasses.replace(
        design, tasks={"reach": dataclasses.replace(design.tasks["reach"], **settings)}
    )


@pytest.mark.parametrize(
    ("change", "goes"),
    [
        (lambda design: design, set()),
        (lambda design: dataclasses.replace(design, seeds=(0,)), set()),
        (lambda design: changed(design, episodes=4), {"policy", "nominal", "disturbed", "protected"}),
        (lambda design: changed(design, steps=11), {"policy", "nominal", "disturbed", "protected"}),
        (lambda design: changed(design, rollout_limit=9.0), {"nominal", "disturbed", "protected"}),
        (lambda design: dataclasses.replace(design, rollouts=41), {"nominal"}),
        (lambda design: dataclasses.replace(design, persons=1), "all"),
        (lambda design: dataclasses.replace(design, seed=7), "all"),
        (lambda design: changed(design, time_limit={"ee": 3.0}), "all"),
    ],
)
def test_what_other_settings_made_is_removed_and_nothing_else(change, goes, tmp_path, preset):
    design, layout, found = everything(tmp_path, preset)
    names = {"collect/reach/ee", "policy/reach/ee/realised-time-0"}
    collect, policy = (job for job in found if job.name in names)
    made = {"dataset": layout.dataset(collect.cell), "policy": layout.policy(policy.arm)}
    made |= {what: layout.evaluation(policy.arm, what) for what in ("nominal", "disturbed", "protected")}
    for job in (collect, policy):
        begin(job, change(design), layout)
    assert {name for name, path in made.items() if not path.exists()} == (
        set(made) if goes == "all" else goes
    )


def test_rollouts_of_a_policy_that_is_gone_go_too(tmp_path, preset):
    design, layout, found = everything(tmp_path, preset)
    job = next(job for job in found if job.arm)
    shutil.rmtree(layout.policy(job.arm))
    begin(job, design, layout)
    assert not layout.evaluation(job.arm, "nominal").exists()


def test_what_nobody_knows_the_settings_of_is_neither_used_nor_removed(tmp_path, preset):
    design, layout, found = everything(tmp_path, preset)
    for job in found[:1] + [job for job in found if job.arm][:1]:
        layout.begun(job).unlink()
        with pytest.raises(HandrailError, match="expected a note"):
            begin(job, design, layout)
        made = layout.dataset(job.cell) if job.cell else layout.policy(job.arm)
        assert made.exists()


def test_the_preset_s_sizes_are_part_of_what_a_policy_depends_on(tmp_path, preset, monkeypatch):
    design, layout, found = everything(tmp_path, preset)
    policies = {job.name for job in found if job.arm}
    assert Standing(design, layout).missing == []
    monkeypatch.setitem(presets._ACT_CPU, "dropout", 0.1)
    lost = {job.name for job in found if not is_done(job, design, layout)}
    assert lost == policies | {job.name for job in found if job.task}


def test_every_setting_of_the_design_is_part_of_what_something_depends_on(preset):
    """But for the name, and for what says only how many jobs there are."""
    design = load_design(preset)

    def prints(design):
        return {job.name: fingerprint(job, design) for job in jobs(design)}

    others = [dataclasses.replace(design, **{key: value}) for key, value in (
        ("baseline", "ee"), ("policy", "diffusion"), ("rollouts", 41), ("persons", 1), ("seed", 1),
        ("budgets", ("number",)), ("robustness", None), ("sweep", None), ("seeds", (3,)),
    )]  # fmt: skip
    others += [changed(design, **{key: value}) for key, value in (
        ("episodes", 6), ("minutes", 0.2), ("steps", 11), ("batch_size", 4), ("time_limit", {"ee": 3.0}),
        ("rollout_limit", 9.0), ("policy_options", ("dropout=0.2",)),
    )]  # fmt: skip
    assert all(prints(other) != prints(design) for other in others)
    assert prints(dataclasses.replace(design, name="other")) == prints(design)


BREAK = {
    "an empty data folder": ("collect", lambda root: shutil.rmtree(root / "datasets/reach/ee/data")),
    "no dataset": ("collect", lambda root: shutil.rmtree(root / "datasets/reach/ee")),
    "fewer episodes": (
        "collect",
        lambda root: edit(root / "datasets/reach/ee/meta/info.json", "total_episodes", 5),
    ),
    "no policy": ("policy", lambda root: shutil.rmtree(root / "policies/reach/ee/realised-time-0")),
    "no rollouts": ("policy", lambda root: (root / EE.format("protected")).unlink()),
    "half a file": ("policy", lambda root: (root / EE.format("nominal")).write_text('{"format": ')),
    "a rollout less": ("policy", lambda root: drop_rollout(root / EE.format("disturbed"))),
    "no report": ("compare", lambda root: (root / "comparisons/reach/report.html").unlink()),
}
EE = "evaluations/reach/ee/{}/realised-time-0.json"


def edit(path, key, value):
    write_json(path, read_json(path) | {key: value})


def drop_rollout(path):
    content = read_json(path)
    content["arms"]["ee pushed"][0]["rollouts"].pop()
    write_json(path, content)


@pytest.mark.parametrize("case", BREAK)
def test_done_means_that_everything_is_there(case, tmp_path, preset):
    kind, damage = BREAK[case]
    design, layout, _ = everything(tmp_path, preset)
    damage(layout.root)
    name = {
        "collect": "collect/reach/ee",
        "policy": "policy/reach/ee/realised-time-0",
        "compare": "compare/reach",
    }
    assert Standing(design, layout).missing == [name[kind]]


def test_the_report_has_nothing_of_other_settings_and_counts_what_is_missing(tmp_path, preset):
    design, layout, found = everything(tmp_path, preset)
    page = tmp_path / "page.md"

    def report(text):
        Path(preset).write_text(text)
        config = StudyConfig(preset, str(layout.root), page=str(page), report_only=True)
        assert run_study(config, Starter()) == 0
        content = json.loads((layout.root / "study.json").read_text())
        return content["tasks"]["reach"], content["missing"]

    results, missing = report(DESIGN.replace("seeds = [0, 1]", "seeds = [0]"))
    assert missing == ["compare/reach"]
    assert [arm["rollouts"] for arm in results["policies"]["arms"]] == [40, 40, 40]
    results, missing = report(DESIGN.replace("steps = 10", "steps = 11"))
    assert results["policies"] is None
    assert not results["disturbed"]
    assert set(results["collected"]) == {"ee", "direct"}
    words = f"{len(missing)} of {len(found)} jobs are not done yet: "
    assert words in page.read_text()
    assert words in (layout.root / "report.html").read_text()
    results, missing = report(DESIGN.replace("seeds = [0, 1]", "persons = 1\nseeds = [0, 1]", 1))
    assert len(missing) == len(found)
    assert not results["collected"]
    report(DESIGN)
    assert "not done yet" not in page.read_text()


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
    with pytest.raises(HandrailError, match="--report_only: expected a study in .*study, found none"):
        run_study(config, Starter())
    assert not (tmp_path / "study").exists()
    (tmp_path / "study" / "begun").mkdir(parents=True)
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
        (("minutes = 0.1", "minutes = nan"), "minutes ≥ 0"),
        (("minutes = 0.1", "minutes = 0.1\nrollout_limit = -1.0"), "time_limit -1.0: expected 0"),
        (("minutes = 0.1", "minutes = 0.1\ntime_limit = {ee = -3.0}"), "collect/reach/ee: --time_limit -3"),
        (("minutes = 0.1", "minutes = 0.1\nbatch_size = -4"), "--batch_size -4"),
        (("minutes = 0.1", 'minutes = 0.1\npolicy_options = ["nonsense"]'), "expected key=value"),
        (("seeds = [0, 1]", "seed = -1\nseeds = [0, 1]"), "--seed -1"),
        (("seeds = [0, 1]", "seeds = [0, -1]"), "robustness.seeds"),
        (("seeds = [0]", "seeds = [-1]"), "--seed -1"),
        (("rollouts = 40", "rollouts = 2000000"), "--episodes 2000000"),
        (("rollouts = 20", "rollouts = -5"), "--episodes -5"),
        (('["push"]', '["pusch"]'), "pusch"),
        (('["push"]', "[]"), "robustness.perturbations expected some"),
        (('["filter"]', '["fltr"]'), "unknown protection 'fltr'"),
        (("rollouts = 20\nseeds = [0, 1]", "seeds = [2]"), "robustness.seeds expected some of"),
        (("noises = [0.0]", "noises = [-1.0]"), "--noise -1"),
        (("noises = [0.0]", "noises = []"), "sweep.noises expected some"),
        (("noises = [0.0]", "noises = [0.3, 0.30000000001]"), "expected every job once"),
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
    ("change", "words"),
    [
        (('baseline = "direct"', 'baseline = "direct"\npolicy = "atc"'), "expected one of act"),
        (("minutes = 0.1", 'minutes = 0.1\npolicy_options = ["dim_model=130"]'), "policy act: embed_dim"),
    ],
)
def test_a_policy_that_cannot_be_built_is_known_before_anything_begins(change, words, tmp_path, preset):
    Path(preset).write_text(DESIGN.replace(*change))
    starter = Starter()
    with pytest.raises(HandrailError, match=words):
        run_study(StudyConfig(preset, str(tmp_path / "study")), starter)
    assert starter.begun == []
    assert not (tmp_path / "study").exists()


def test_every_setting_of_a_design_is_explained_where_people_look():
    written = design_module.__doc__ or ""
    for kind in (StudyDesign, TaskDesign, Robustness, Sweep):
        for entry in dataclasses.fields(kind):
            described = f"\n{entry.name} = " in written or f"[{entry.name}" in written
            assert described or entry.name == "name", entry.name


def test_a_failed_job_is_told_by_what_it_said_this_time(tmp_path):
    log = tmp_path / "job.log"
    log.write_text("error: disk full, last week\n")
    _mark(log, "collect/reach/ee")
    assert "without a word (exit code -9" in _last_words(log, -9)
    with open(log, "a") as file:
        file.write("warning\nerror: of today\nlast\n")
    assert _last_words(log, 1).startswith("of today (exit code 1")


@pytest.mark.parametrize("marks", ["{0}\nold", "old\n{1}", "{1}\nold\n{0}", "{0}\n{0}\n{1}", "{0}\n{1}\n{1}"])
def test_a_page_whose_marks_are_no_pair_is_left_alone_before_anything_begins(marks, tmp_path, preset):
    page, starter = tmp_path / "page.md", Starter()
    text = (
        "# Ours\n" + marks.format("<!-- study small -->", "<!-- end of study small -->") + "\nMy own words.\n"
    )
    page.write_text(text)
    with pytest.raises(HandrailError, match="--page: expected"):
        run_study(StudyConfig(preset, str(tmp_path / "study"), page=str(page)), starter)
    assert page.read_text() == text
    assert starter.begun == []


def test_a_page_keeps_all_that_is_not_between_the_marks():
    old = "before\n<!-- study a -->\nold\n<!-- end of study a -->\nbetween\n<!-- study b -->\nb\n<!-- end of study b -->"
    new = between_marks(old, "a", "new")
    assert new == old.replace("\nold\n", "\n\nnew\n\n")
    assert between_marks(new, "a", "new") == new
    assert between_marks("text", "c", "new").startswith("text\n")


@pytest.mark.parametrize("place", ["file", "file/below", "/proc/nope"])
def test_a_folder_that_cannot_be_is_one_line(place, tmp_path, preset):
    (tmp_path / "file").touch()
    with pytest.raises(HandrailError, match="--output .*: expected a folder"):
        run_study(StudyConfig(preset, str(tmp_path / place)), Starter())


def test_a_second_study_in_a_folder_is_told_what_the_first_is(tmp_path, preset):
    lock = DatasetLock(tmp_path / "study" / ".study")
    try:
        with pytest.raises(HandrailError, match="study .* another handrail-study"):
            run_study(StudyConfig(preset, str(tmp_path / "study")), Starter())
    finally:
        lock.release()


@pytest.mark.parametrize("missing", ["torch", "accelerate"])
def test_what_is_not_installed_is_said_before_anything_begins(missing, tmp_path, preset, monkeypatch):
    monkeypatch.setattr(
        "handrail.policies.imitation.installed.find_spec", lambda name: name != missing or None
    )
    starter = Starter()
    with pytest.raises(HandrailError, match=f"handrail-study: expected {missing}"):
        run_study(StudyConfig(preset, str(tmp_path / "study")), starter)
    assert starter.begun == []


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
