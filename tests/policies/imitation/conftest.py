"""A dataset and a training that several files of tests look at, and none changes."""

import pytest
from canned import canned
from training_helpers import tiny, write_dataset

from handrail.policies.imitation.training.training import train


@pytest.fixture(scope="session")
def recorded():
    return canned(write_dataset)


@pytest.fixture(scope="session")
def trained(recorded, tmp_path_factory):
    """A training that was never interrupted, and its settings."""
    config = tiny(recorded, tmp_path_factory.mktemp("trained") / "policy")
    return train(config), config
