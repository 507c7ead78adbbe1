"""Where jobs run: in this process, in others, and on a Ray cluster of two computers, both here."""

import pytest

from handrail.collect.execution.config import ExecutionConfig


@pytest.fixture(scope="session")
def cluster():
    pytest.importorskip("ray.cluster_utils", reason="needs Ray: pip install '.[cluster]'")
    from ray_helpers import two_computers

    with two_computers() as made:
        yield made


@pytest.fixture
def config(request):
    """The settings of so many workers, or of the cluster."""
    if request.param == "ray":
        return ExecutionConfig(ray=request.getfixturevalue("cluster").address)
    return ExecutionConfig(workers=request.param)
