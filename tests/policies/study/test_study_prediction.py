"""A study says which metric of its demonstrations goes with the success of its policies."""

import json

import numpy as np
from made_study import MODES, TASK
from made_study import SHARES as MADE
from study_helpers import make

from handrail.policies.study.design.design import StudyDesign
from handrail.policies.study.design.jobs import Layout, jobs
from handrail.policies.study.design.progress import StudyProgress
from handrail.policies.study.report.prediction import predicted
from handrail.policies.study.report.results import gather

SHARES = {mode: MADE[mode] for mode in MODES} | {
    "leader": (0.4, 0.5, 0.45, 0.4),
    "ee_dls": (0.6, 0.55, 0.6, 0.5),
    "switching": (0.3, 0.2, 0.3, 0.25),
}
DESIGN = StudyDesign("made", tuple(SHARES), {"reach": TASK, "tray": TASK}, "direct", draws=4, rollouts=20)


def test_a_metric_that_goes_with_success_is_seen_and_one_that_does_not_is_not(tmp_path):
    layout, rng = Layout(tmp_path / "study"), np.random.default_rng(1)
    for job in jobs(DESIGN):
        make(job, DESIGN, layout, SHARES)
        if job.policy is None:
            note = json.loads(layout.done(job).read_text())
            note["result"]["quality"] = {"jerk": -SHARES[job.cell.mode][job.cell.draw], "path": rng.normal()}
            note["result"]["learnability"] = {}
            layout.done(job).write_text(json.dumps(note))
    found = {each.metric: each for each in predicted(gather(StudyProgress(DESIGN, layout)))}
    assert found["jerk"].between.units == 14
    assert found["jerk"].within.units == 56
    assert found["jerk"].between.estimate < -0.9
    assert found["jerk"].detected
    assert not found["path"].detected
