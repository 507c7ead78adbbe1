"""Done means: with these settings, and whole; what others made is removed, and never reported."""

import dataclasses
import json
import shutil
from pathlib import Path

import pytest
from study_helpers import COLLECTED, DESIGN, Starter, changed, everything, run_here

from handrail.collect.commands import record as record_module
from handrail.controllers.errors import HandrailError
from handrail.datasets.storage.strict_json import known_json, write_json
from handrail.policies.imitation.training import presets
from handrail.policies.study import work as work_module
from handrail.policies.study.config import StudyConfig
from handrail.policies.study.design import DeclaredPair
from handrail.policies.study.jobs import StudyCell, StudyLayout, jobs
from handrail.policies.study.progress import StudyProgress
from handrail.policies.study.settings import evaluations, fingerprint, load_design, recording, training
from handrail.policies.study.work import begin, collect, do, work


@pytest.mark.parametrize(
    ("change", "goes"),
    [
        (lambda design: design, set()),
        (lambda design: dataclasses.replace(design, draws=1), set()),
        (lambda design: changed(design, episodes=6), {"policy", "nominal", "disturbed", "protected"}),
        (lambda design: changed(design, steps=11), {"policy", "nominal", "disturbed", "protected"}),
        (lambda design: changed(design, rollout_limit=9.0), {"nominal", "disturbed", "protected"}),
        (lambda design: dataclasses.replace(design, rollouts=41), {"nominal"}),
        (lambda design: changed(design, minutes=0.05), "all"),
        (lambda design: dataclasses.replace(design, persons=1), "all"),
        (lambda design: dataclasses.replace(design, seed=7), "all"),
    ],
)
def test_results_of_other_settings_are_removed_and_nothing_else(change, goes, tmp_path, preset):
    design, layout, found = everything(tmp_path, preset)
    names = {"collect/reach/ee/0", "policy/reach/ee/0/realised-time"}
    collect, policy = (job for job in found if job.name in names)
    made = {"dataset": layout.dataset(collect.cell), "policy": layout.policy(policy.policy)}
    made |= {what: layout.evaluation(policy.policy, what) for what in ("nominal", "disturbed", "protected")}
    for job in (collect, policy):
        begin(job, change(design), layout)
    assert {name for name, path in made.items() if not path.exists()} == (
        set(made) if goes == "all" else goes
    )


def test_a_job_begun_with_other_settings_is_done_with_none(tmp_path, preset):
    """Law: a study that goes on as it was before never takes what was made in between for its own."""
    design, layout, found = everything(tmp_path, preset)
    other = changed(dataclasses.replace(design, persons=1), steps=11)
    begun = found[0], next(job for job in found if job.policy)
    for job in begun:
        begin(job, other, layout)
    assert StudyProgress(design, layout).missing == [job.name for job in begun]
    for job in found:
        begin(job, design, layout)  # and the note of what is done with just these stays
    assert StudyProgress(design, layout).missing == [job.name for job in begun]


def test_checkpoints_have_as_many_digits_as_lerobot_gives_them(preset):
    design = dataclasses.replace(load_design(preset), curve=(500000,))
    (job, *_) = (job for job in jobs(design) if job.policy)
    asked = evaluations(job, design, "run/checkpoints/1000000/model")
    assert asked["after-500000"].policy == ("run/checkpoints/0500000/model",)


@pytest.mark.parametrize("left", [[], [".handrail/lock"], ["meta/handrail.json"]])
def test_a_dataset_that_was_hardly_begun_is_recorded(left, tmp_path, preset, monkeypatch):
    """After a power cut there may be a folder without a dataset."""
    design, layout = load_design(preset), StudyLayout(tmp_path / "study")
    (job, *_) = jobs(design)
    root, turns = layout.dataset(job.cell), []
    root.mkdir(parents=True)
    for name in left:
        (root / name).parent.mkdir()
        (root / name).touch()
    monkeypatch.setattr(record_module, "record", lambda config, share: turns.append(config.resume) or 1)
    with pytest.raises(HandrailError, match="exit code 1"):
        collect(job, design, layout)
    assert turns == [left == ["meta/handrail.json"]]


def test_rollouts_of_a_policy_that_is_gone_go_too(tmp_path, preset):
    design, layout, found = everything(tmp_path, preset)
    job = next(job for job in found if job.policy)
    shutil.rmtree(layout.policy(job.policy))
    begin(job, design, layout)
    assert not layout.evaluation(job.policy, "nominal").exists()


def test_results_of_unknown_settings_are_neither_used_nor_removed(tmp_path, preset):
    design, layout, found = everything(tmp_path, preset)
    for job in found[:1] + [job for job in found if job.policy][:1]:
        layout.begun(job).unlink()
        with pytest.raises(HandrailError, match="expected a note"):
            begin(job, design, layout)
        made = layout.policy(job.policy) if job.policy else layout.dataset(job.cell)
        assert made.exists()


def test_the_preset_s_sizes_are_part_of_what_a_policy_depends_on(tmp_path, preset, monkeypatch):
    design, layout, found = everything(tmp_path, preset)
    policies = [job.name for job in found if job.policy]
    assert StudyProgress(design, layout).missing == []
    monkeypatch.setitem(presets.ACT_CPU, "dropout", 0.1)
    assert StudyProgress(design, layout).missing == policies


def test_every_setting_of_the_design_is_part_of_what_something_depends_on(preset):
    """But for the name, and for what only the report looks at."""
    design = load_design(preset)

    def prints(design):
        return {job.name: fingerprint(job, design) for job in jobs(design)}

    others = [dataclasses.replace(design, **{key: value}) for key, value in (
        ("policy", "diffusion"), ("rollouts", 41), ("persons", 1), ("seed", 1),
        ("beside", None), ("robustness", None), ("draws", 3), ("curve", (5,)),
        ("encoders", dict.fromkeys(design.tasks, "ridgeback_ur10-reach")),
    )]  # fmt: skip
    others += [changed(design, **{key: value}) for key, value in (
        ("episodes", 6), ("minutes", 0.2), ("steps", 11), ("batch_size", 4), ("rollout_limit", 9.0),
        ("time_limit", 9.0), ("sizes", (0.05,)),
    )]  # fmt: skip
    assert all(prints(other) != prints(design) for other in others)
    assert len({str(prints(other)) for other in others}) == len(others)
    same = {"name": "other", "baseline": "ee", "pairs": (DeclaredPair("ee", "direct"),)}
    assert prints(dataclasses.replace(design, **same)) == prints(design)


def test_half_of_a_mixed_recording_is_of_each_mode_and_smaller_policies_learn_from_it_too(tmp_path, preset):
    cell = StudyCell("reach", "ee_and_leader", 0)
    design = changed(load_design(preset), sizes=(0.05,))
    design = dataclasses.replace(design, modes=("ee_and_leader", "direct"), beside=None, curve=(5,))
    modes = [recording(cell, design, tmp_path, share=share).mode for share in (0.0, 0.49, 0.5, 1.0)]
    assert modes == ["ee", "ee", "leader", "leader"]
    found = {job.policy: job for job in jobs(design) if job.cell == cell and job.policy}
    assert [policy.label for policy in found] == ["ee_and_leader", "ee_and_leader 0.05 min"]
    minutes = [training(policy, design, tmp_path, tmp_path).minutes for policy in found]
    assert minutes == [0.1, 0.05]
    whole, less = (evaluations(job, design, "run/checkpoints/000010/model") for job in found.values())
    assert "after-5" not in less
    assert whole["after-5"].policy == ("run/checkpoints/000005/model",)
    assert {training(policy, design, tmp_path, tmp_path).save_freq for policy in found} == {5}


BREAK = {
    "no note": ("collect", lambda root: (root / "done/collect/reach/ee/0.json").unlink()),
    "no rollouts": ("policy", lambda root: (root / EE.format("protected")).unlink()),
    "half a file": ("policy", lambda root: (root / EE.format("nominal")).write_text('{"format": ')),
    "a rollout less": ("policy", lambda root: drop_rollout(root / EE.format("disturbed"))),
}
EE = "evaluations/reach/ee/0/{}/realised-time.json"


def edit(path, key, value):
    write_json(path, known_json(path) | {key: value})


def drop_rollout(path):
    content = known_json(path)
    content["arms"]["ee pushed"][0]["rollouts"].pop()
    write_json(path, content)


@pytest.mark.parametrize("case", BREAK)
def test_done_means_that_everything_is_there(case, tmp_path, preset):
    kind, damage = BREAK[case]
    design, layout, _ = everything(tmp_path, preset)
    damage(layout.root)
    name = {"collect": "collect/reach/ee/0", "policy": "policy/reach/ee/0/realised-time"}
    assert StudyProgress(design, layout).missing == [name[kind]]


def test_more_rollouts_than_are_asked_for_do_no_harm(tmp_path, preset):
    design, layout, _ = everything(tmp_path, preset)
    assert StudyProgress(dataclasses.replace(design, robustness=None), layout).missing == []


def test_the_report_has_nothing_of_other_settings_and_counts_what_is_missing(tmp_path, preset):
    _, layout, found = everything(tmp_path, preset)
    page = tmp_path / "page.md"

    def report(text):
        Path(preset).write_text(text)
        config = StudyConfig(preset, str(layout.root), page=str(page), report_only=True)
        assert run_here(config, Starter()) == 0
        content = json.loads((layout.root / "study.json").read_text())
        return content, content["missing"]

    results, missing = report(DESIGN.replace("draws = 2", "draws = 1"))
    assert missing == []
    assert {each["rollouts"] for each in results["conditions"] if not each["treatment"]} == {40}
    results, missing = report(DESIGN.replace("steps = 10", "steps = 11"))
    assert results["conditions"] == results["contrasts"] == []
    assert {name.partition("/")[0] for name in results["jobs"]} == {"collect"}
    words = f"{len(missing)} of {len(found)} jobs are not done yet"
    assert words in page.read_text()
    assert words in (layout.root / "report.html").read_text()
    results, missing = report(DESIGN.replace("draws = 2", "persons = 1\ndraws = 2", 1))
    assert len(missing) == len(found)
    assert not results["jobs"]
    report(DESIGN)
    assert "not done yet" not in page.read_text()


def test_large_files_may_go_and_are_made_again_only_where_needed(tmp_path, preset):
    design, layout, _ = everything(tmp_path, preset)
    for folder in ("datasets", "policies", "logs"):
        shutil.rmtree(layout.root / folder, ignore_errors=True)
    config, idle = StudyConfig(preset, str(layout.root)), Starter()
    assert run_here(config, idle) == 0
    assert idle.begun == []
    (layout.root / EE.format("nominal")).unlink()
    again = Starter()
    assert run_here(config, again) == 0
    assert again.begun == ["collect/reach/ee/0", "policy/reach/ee/0/realised-time"]
    assert StudyProgress(design, layout).todo() == []


@pytest.mark.parametrize(
    "damage",
    [
        lambda root: shutil.rmtree(root / "data"),
        lambda root: edit(root / "meta/info.json", "total_episodes", 5),
        lambda root: (root / "meta/info.json").write_text("{"),
    ],
)
def test_a_dataset_that_is_not_whole_is_recorded_before_it_is_learnt_from(damage, tmp_path, preset):
    design, layout, found = everything(tmp_path, preset)
    collect, policy = found[0], next(job for job in found if job.policy and job.cell == found[0].cell)
    damage(layout.dataset(collect.cell))
    assert StudyProgress(design, layout).todo() == []
    layout.done(policy).unlink()
    assert StudyProgress(design, layout).todo() == [collect, policy]


def test_recorded_again_another_way_is_told(tmp_path, preset, monkeypatch):
    design, layout, found = everything(tmp_path, preset)
    edit(layout.done(found[0]), "result", {"digest": "d1ce"})
    monkeypatch.setattr(work_module, "collect", lambda job, design, layout: None)
    monkeypatch.setattr(work_module, "summary", lambda root, seed: dict(COLLECTED, digest="d1ce+pictures"))
    assert "digest_before" not in work(found[0], design, layout)  # an earlier version left the pictures out
    monkeypatch.setattr(work_module, "summary", lambda root, seed: dict(COLLECTED, digest="0ther"))
    do(found[0], design, layout.root)
    assert run_here(StudyConfig(preset, str(layout.root), report_only=True), Starter()) == 0
    html = (layout.root / "report.html").read_text()
    assert "the rows were others than before: reach/ee/0" in html


def test_a_cell_alone_is_only_its_jobs(tmp_path, preset):
    starter = Starter()
    config = StudyConfig(preset, str(tmp_path / "study"), only="reach/ee/1")
    assert run_here(config, starter) == 0
    names = [job.name for job in jobs(load_design(preset)) if job.cell.name == "reach/ee/1"]
    assert starter.begun == names
    with pytest.raises(
        HandrailError, match=r"unknown cell of the study 'reach/ee/2': expected one of .*reach/ee/0"
    ):
        run_here(dataclasses.replace(config, only="reach/ee/2"), Starter())


def test_a_design_that_is_changed_after_the_beginning_shows(tmp_path, preset):
    config = StudyConfig(preset, str(tmp_path / "study"))
    assert run_here(config, Starter()) == 0
    first = load_design(preset).digest
    Path(preset).write_text("# the same\n" + DESIGN.replace("rollouts = 40", "rollouts   =  40  # each"))
    assert load_design(preset).digest == first
    assert run_here(config, Starter()) == 0
    assert "design was changed" not in (tmp_path / "study/report.html").read_text()
    Path(preset).write_text(DESIGN.replace("rollouts = 40", "rollouts = 39"))
    second = load_design(preset).digest
    assert run_here(config, Starter()) == 0
    said = (tmp_path / "study/report.html").read_text()
    assert "design was changed" in said
    assert first in said
    assert second in said


def test_draws_are_done_one_after_the_other_and_share_nothing(preset):
    design = load_design(preset)
    found = jobs(design)
    assert [job.cell.draw for job in found] == sorted(job.cell.draw for job in found)
    draws = []
    for draw in range(design.draws):
        mine = [job for job in found if job.cell.draw == draw]
        turns = [recording(job.cell, design, Path("set"), 10 * turn) for job in mine for turn in range(5)]
        driven = [each for job in mine if job.policy for each in evaluations(job, design).values()]
        seeds = {seed for each in driven for seed in each.seeds}
        draws.append(({each.seed for each in turns}, {each.person for each in turns}, seeds))
    for one, other in zip(*draws, strict=True):
        assert one
        assert not one & other
