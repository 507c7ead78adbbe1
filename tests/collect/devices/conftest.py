"""Shared by the tests of devices."""

import pytest
from device_players import Clock


@pytest.fixture
def clock():
    return Clock()
