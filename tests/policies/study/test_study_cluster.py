"""A study on a Ray cluster of two computers is the study of two workers: datasets, rollouts, report."""

import json

import pytest
from ray_helpers import two_computers
from shared_helpers import content
from study_helpers import SMALLEST

from handrail.policies.study.config import StudyConfig
from handrail.policies.study.execution.run import run_study

pytest.importorskip("ray.cluster_utils", reason="needs Ray: pip install '.[cluster]'")
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]
CLOCKS = ("started", "wall_time", "seconds", "time", "solve_time")


def test_the_results_do_not_depend_on_where_the_jobs_ran(tmp_path):
    preset = tmp_path / "tiny.toml"
    preset.write_text(SMALLEST)
    pool, far = tmp_path / "pool", tmp_path / "far"
    assert run_study(StudyConfig(preset=str(preset), output=str(pool))) == 0
    with two_computers() as cluster:
        assert run_study(StudyConfig(preset=str(preset), output=str(far), ray=cluster.address)) == 0
    for mode in ("ee", "direct"):
        name = f"datasets/reach/{mode}"
        assert content(far / name) == content(pool / name)
    files = sorted(path.relative_to(pool) for path in pool.glob("evaluations/**/*.json"))
    assert len(files) == 8
    assert files == sorted(path.relative_to(far) for path in far.glob("evaluations/**/*.json"))
    for file in files:
        assert told(far / file, far) == told(pool / file, pool)


def told(file, root):
    """Return what a file of rollouts says, without clocks and the folder's name."""
    return without_clocks(json.loads(file.read_text().replace(str(root), "STUDY")))


def without_clocks(value):
    if isinstance(value, dict):
        return {key: without_clocks(each) for key, each in value.items() if key not in CLOCKS}
    return [without_clocks(each) for each in value] if isinstance(value, list) else value
