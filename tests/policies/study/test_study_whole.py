"""A study of real jobs, small: it collects, trains, lets policies drive, reports; any cell comes again."""

import json
import shutil

import pytest
from study_helpers import SMALLEST

from handrail.policies.study.config import StudyConfig
from handrail.policies.study.run import run_study


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """A study that was run to its end, and its design's file."""
    folder = tmp_path_factory.mktemp("whole")
    preset = folder / "tiny.toml"
    preset.write_text(SMALLEST)
    assert run_study(StudyConfig(preset=str(preset), output=str(folder / "study"), workers=2)) == 0
    return folder / "study", preset


def rollouts(study, cell):
    """Return the rollouts of a cell's policies without what the clock said, by file and label."""
    found = {}
    for file in sorted(study.glob(f"evaluations/{cell}/*/*.json")):
        for label, (entry,) in json.loads(file.read_text())["arms"].items():
            rows = [{k: v for k, v in row.items() if k != "timing"} for row in entry["rollouts"]]
            found[file.relative_to(study).as_posix(), label] = rows, entry["checkpoint"]
    return found


def note(study, name):
    return json.loads((study / "done" / f"{name}.json").read_text())


@pytest.mark.slow
def test_from_collecting_to_the_report(ran):
    study, _ = ran
    files = sorted(study.glob("evaluations/**/*.json"))
    count = {"nominal": 0, "disturbed": 0, "protected": 0}
    for file in files:
        count[file.parent.name] += 1
    assert count == {"nominal": 7, "disturbed": 3, "protected": 2}  # an intent has a protection of its own
    arms = [json.loads(file.read_text())["arms"] for file in files]
    rows = [row for entries in arms for runs in entries.values() for run in runs for row in run["rollouts"]]
    assert len(rows) == 7 * 3 + 3 * 2 + 2 * 2
    assert max(row["length"] for row in rows) == pytest.approx(1.5)  # untrained: none arrives before
    assert {row["ended"] for row in rows if not row["success"]} <= {"stalled", "moving"}
    page = (study / "report.html").read_text()
    assert all(label in page for label in ("ee intent", "direct same number", "pushed", "filter"))
    content = json.loads((study / "study.json").read_text())
    assert content["missing"] == []
    for name, job in content["jobs"].items():
        assert job["took"]["processor_seconds"] > 0.0
        if name.startswith("policy/"):
            assert job["result"]["steps"] == 20
    for policies in study.glob("policies/**/checkpoints"):
        assert len([path for path in policies.iterdir() if path.name.isdecimal()]) == 1


@pytest.mark.slow
def test_one_cell_again_gives_the_same_rows_and_the_same_rollouts(ran, tmp_path):
    study, preset = ran
    again = tmp_path / "again"
    assert run_study(StudyConfig(preset=str(preset), output=str(again), only="reach/ee/0", workers=1)) == 0
    name = "collect/reach/ee/0"
    assert note(again, name)["result"] == note(study, name)["result"]
    assert rollouts(again, "reach/ee/0") == rollouts(study, "reach/ee/0") != {}


@pytest.mark.slow
def test_a_study_whose_large_files_are_gone_goes_on(ran, tmp_path):
    study, preset = ran
    kept = tmp_path / "study"
    shutil.copytree(study, kept, ignore=shutil.ignore_patterns("datasets", "policies", "logs"))
    name, lost = "policy/reach/direct/1/realised-time", "evaluations/reach/direct/1/nominal"
    (kept / "done" / f"{name}.json").unlink()
    shutil.rmtree(kept / lost)
    assert run_study(StudyConfig(preset=str(preset), output=str(kept), workers=2)) == 0
    assert [path.name for path in (kept / "datasets/reach").iterdir()] == ["direct"]
    assert rollouts(kept, "reach/direct/1") == rollouts(study, "reach/direct/1") != {}
    assert "digest_before" not in note(kept, "collect/reach/direct/1")["result"]
