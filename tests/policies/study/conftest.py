"""What a study gathers of made-up rollouts."""

import pytest
from made_study import DESIGN, SHARES
from study_helpers import DESIGN as SMALL
from study_helpers import make

from handrail.policies.study.jobs import StudyLayout, jobs
from handrail.policies.study.progress import StudyProgress
from handrail.policies.study.results import gather


@pytest.fixture
def gathered(tmp_path):
    """Return what a study gathers of made-up rollouts; some of its jobs may be missing."""

    def found(design=DESIGN, shares=SHARES, missing=lambda job: False):
        layout = StudyLayout(tmp_path / "study")
        for job in jobs(design):
            if not missing(job):
                make(job, design, layout, shares)
        return gather(StudyProgress(design, layout))

    return found


@pytest.fixture
def preset(tmp_path):
    """Return the path of a small design."""
    path = tmp_path / "small.toml"
    path.write_text(SMALL)
    return str(path)
