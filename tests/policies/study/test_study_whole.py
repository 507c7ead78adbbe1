"""A study of real jobs, small: it collects, trains, lets the policies drive, compares and reports."""

import json

import pytest
from study_helpers import SMALLEST

from handrail.policies.study.config import StudyConfig
from handrail.policies.study.execution.run import run_study


@pytest.mark.slow
def test_from_collecting_to_the_report(tmp_path):
    preset = tmp_path / "tiny.toml"
    preset.write_text(SMALLEST)
    study = tmp_path / "study"
    assert run_study(StudyConfig(preset=str(preset), output=str(study), workers=2)) == 0

    files = sorted(study.glob("evaluations/**/*.json"))
    assert [file.relative_to(study / "evaluations/reach").parts[:2] for file in files] == [
        (mode, what)
        for mode, policies in (("direct", 1), ("ee", 2))
        for what in ("disturbed", "nominal", "protected")
        for _ in range(policies if what != "protected" else 1)  # an intent has a protection of its own
    ]
    arms = [json.loads(file.read_text())["arms"] for file in files]
    rows = [row for entries in arms for runs in entries.values() for run in runs for row in run["rollouts"]]
    assert len(rows) == 3 * 3 + 3 * 2 + 2 * 2
    assert max(row["length"] for row in rows) == pytest.approx(1.5)  # untrained: none arrives before
    page = (study / "report.html").read_text()
    assert all(label in page for label in ("ee intent", "direct", "pushed", "filter"))
