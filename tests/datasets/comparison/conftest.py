"""What the tests of comparisons share."""

import pytest


@pytest.fixture(scope="module")
def few_resamples():
    """Few resamples: what is tested with them does not hang on the third digit of p."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("handrail.datasets.statistics.resampling.RESAMPLES", 500)
        yield
