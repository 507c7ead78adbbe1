"""What the tests of comparisons share."""

import pytest
from canned import canned
from compare_helpers import quick_and_slow


@pytest.fixture(scope="module")
def few_resamples():
    """Few resamples: what is tested with them does not hang on the third digit of p."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("handrail.datasets.statistics.resampling.RESAMPLES", 500)
        yield


@pytest.fixture(scope="session")
def ours():
    """Two datasets that Handrail recorded: one quick, one slow that fails every other time."""
    return [str(canned(quick_and_slow) / name) for name in ("quick", "slow")]
