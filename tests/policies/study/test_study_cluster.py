"""A study on a Ray cluster of two computers is the study of two workers: datasets, rollouts, report."""

import json

import pytest
from ray_helpers import two_computers
from shared_helpers import content
from study_helpers import SMALLEST

from handrail.policies.study.config import StudyConfig
from handrail.policies.study.run import run_study

pytest.importorskip("ray.cluster_utils", reason="needs Ray: pip install '.[cluster]'")
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore")]


def test_the_results_do_not_depend_on_where_the_jobs_ran(tmp_path):
    preset = tmp_path / "tiny.toml"
    preset.write_text(SMALLEST)
    pool, far = tmp_path / "pool", tmp_path / "far"
    assert run_study(StudyConfig(preset=str(preset), output=str(pool))) == 0
    with two_computers() as cluster:
        assert run_study(StudyConfig(preset=str(preset), output=str(far), ray=cluster.address)) == 0
    datasets = sorted(path.relative_to(pool) for path in pool.glob("datasets/reach/*/*"))
    assert len(datasets) == 4
    for name in datasets:
        assert content(far / name) == content(pool / name)
    weights = sorted(path.relative_to(pool) for path in pool.glob("policies/**/*.safetensors"))
    assert len(weights) >= 3
    assert [(far / path).read_bytes() for path in weights] == [(pool / path).read_bytes() for path in weights]
    files = sorted(path.relative_to(pool) for path in pool.glob("evaluations/**/*.json"))
    kinds = {file.stem for file in files}
    assert kinds == {"realised-time", "realised-number", "intent-time"}
    assert files == sorted(path.relative_to(far) for path in far.glob("evaluations/**/*.json"))
    for file in files:
        assert told(far / file) == told(pool / file)


def told(file):
    """Return what a file of rollouts says, without clocks."""

    def hook(each):
        return {key: each[key] for key in each if key != "timing"}

    return json.loads(file.read_text(), object_hook=hook)
