"""Done means: with these settings, and whole; what others made is removed, and never reported."""

import dataclasses
import json
import shutil
from pathlib import Path

import pytest
from study_helpers import DESIGN, Starter, changed, everything, run_here

from handrail.controllers.errors import HandrailError
from handrail.policies.imitation.training import presets
from handrail.policies.study.config import StudyConfig
from handrail.policies.study.design.jobs import jobs
from handrail.policies.study.design.load import load_design
from handrail.policies.study.design.progress import StudyProgress, is_done, read_json, write_json
from handrail.policies.study.design.settings import fingerprint
from handrail.policies.study.execution.work import begin


@pytest.fixture
def preset(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(DESIGN)
    return str(path)


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
    made = {"dataset": layout.dataset(collect.cell), "policy": layout.policy(policy.policy)}
    made |= {what: layout.evaluation(policy.policy, what) for what in ("nominal", "disturbed", "protected")}
    for job in (collect, policy):
        begin(job, change(design), layout)
    assert {name for name, path in made.items() if not path.exists()} == (
        set(made) if goes == "all" else goes
    )


def test_rollouts_of_a_policy_that_is_gone_go_too(tmp_path, preset):
    design, layout, found = everything(tmp_path, preset)
    job = next(job for job in found if job.policy)
    shutil.rmtree(layout.policy(job.policy))
    begin(job, design, layout)
    assert not layout.evaluation(job.policy, "nominal").exists()


def test_what_nobody_knows_the_settings_of_is_neither_used_nor_removed(tmp_path, preset):
    design, layout, found = everything(tmp_path, preset)
    for job in found[:1] + [job for job in found if job.policy][:1]:
        layout.begun(job).unlink()
        with pytest.raises(HandrailError, match="expected a note"):
            begin(job, design, layout)
        made = layout.dataset(job.cell) if job.cell else layout.policy(job.policy)
        assert made.exists()


def test_the_preset_s_sizes_are_part_of_what_a_policy_depends_on(tmp_path, preset, monkeypatch):
    design, layout, found = everything(tmp_path, preset)
    policies = {job.name for job in found if job.policy}
    assert StudyProgress(design, layout).missing == []
    monkeypatch.setitem(presets.ACT_CPU, "dropout", 0.1)
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
INFO = "datasets/reach/ee/meta/info.json"
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
    assert StudyProgress(design, layout).missing == [name[kind]]


def test_the_report_has_nothing_of_other_settings_and_counts_what_is_missing(tmp_path, preset):
    _, layout, found = everything(tmp_path, preset)
    page = tmp_path / "page.md"

    def report(text):
        Path(preset).write_text(text)
        config = StudyConfig(preset, str(layout.root), page=str(page), report_only=True)
        assert run_here(config, Starter()) == 0
        content = json.loads((layout.root / "study.json").read_text())
        return content["tasks"]["reach"], content["missing"]

    results, missing = report(DESIGN.replace("seeds = [0, 1]", "seeds = [0]"))
    assert missing == ["compare/reach"]
    assert [arm["rollouts"] for arm in results["policies"]["conditions"]] == [40, 40, 40]
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
