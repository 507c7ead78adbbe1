"""A study does every job once, goes on where it was, and reports what is there."""

import json

import pytest
from study_helpers import Starter, run_here

from handrail.controllers.errors import HandrailError
from handrail.policies.study.config import StudyConfig
from handrail.policies.study.jobs import jobs
from handrail.policies.study.settings import PRESETS, load_design


def test_every_job_once_then_none_again(tmp_path, preset):
    config = StudyConfig(preset, str(tmp_path / "study"), workers=3)
    first, second = Starter(), Starter()
    assert run_here(config, first) == 0
    assert sorted(first.begun) == sorted(job.name for job in jobs(load_design(preset)))
    assert len(set(first.begun)) == len(first.begun)
    assert run_here(config, second) == 0
    assert second.begun == []


def test_report_says_what_is_in_the_files(tmp_path, preset):
    page = tmp_path / "page.md"
    page.write_text("# Ours\n\nBefore.\n\n<!-- study small -->\nold\n<!-- end of study small -->\n\nAfter.\n")
    config = StudyConfig(preset, str(tmp_path / "study"), page=str(page))
    assert run_here(config, Starter()) == 0
    content = json.loads((tmp_path / "study/study.json").read_text())
    found = content["conditions"]
    driven = {each["label"]: each for each in found if not each["treatment"]}
    assert set(driven) == {"ee", "ee intent", "direct"}
    assert all(each["rollouts"] == 80 for each in driven.values())
    (ee,) = [each for each in content["contrasts"] if each["group"] == "ee − direct"]
    assert ee["estimate"] == pytest.approx((driven["ee"]["successes"] - driven["direct"]["successes"]) / 80)
    pushed = {each["label"]: each for each in found if each["treatment"] == "pushed"}
    assert set(pushed) == set(driven)
    assert pushed["ee"]["touched"] == pytest.approx(0.5)
    failed = driven["direct"]["rollouts"] - driven["direct"]["successes"]
    assert driven["direct"]["failures"] == {"lift": failed}
    policies = [each for name, each in content["jobs"].items() if name.startswith("policy/")]
    assert all(each["took"]["seconds"] == 10.0 for each in policies)
    assert content["seconds"] == 10.0 * len(content["jobs"])
    assert content["design"]["digest"] == content["designs"][0]["digest"] == load_design(preset).digest
    text = page.read_text()
    assert text.startswith("# Ours\n\nBefore.")
    assert text.endswith("After.\n")
    assert "old" not in text
    assert f"| {100 * driven['direct']['successes'] / 80:.0f} % |" in text
    assert (tmp_path / "page_small_answer.png").is_file()
    html = (tmp_path / "study/report.html").read_text()
    assert f"{100 * driven['ee intent']['successes'] / 80:.0f} %" in html
    for cell in ("reach/ee/0", "reach/direct/1"):
        assert f"handrail-study --preset {preset} --only {cell} --output outputs/again" in html


def test_report_of_a_study_that_has_hardly_begun(tmp_path, preset):
    config = StudyConfig(preset, str(tmp_path / "study"), report_only=True)
    with pytest.raises(HandrailError, match=r"--report_only: expected a study in .*study, found none"):
        run_here(config, Starter())
    assert not (tmp_path / "study").exists()
    (tmp_path / "study" / "begun").mkdir(parents=True)
    assert run_here(config, Starter()) == 0
    assert (tmp_path / "study/report.html").is_file()


def test_a_plan_runs_nothing(tmp_path, preset, capsys):
    starter = Starter()
    assert run_here(StudyConfig(preset, str(tmp_path / "study"), plan=True), starter) == 0
    assert starter.begun == []
    assert not (tmp_path / "study").exists()
    said = capsys.readouterr().err
    assert load_design(preset).digest in said
    assert f"{len(jobs(load_design(preset)))} jobs" in said
    assert "Nothing is declared" in said


@pytest.mark.parametrize("name", [path.stem for path in sorted(PRESETS.glob("*.toml"))])
def test_presets_are_whole(name):
    design = load_design(name)
    names = [job.name for job in jobs(design)]
    assert len(set(names)) == len(names)
    assert {need for job in jobs(design) for need in job.needs} <= set(names)
