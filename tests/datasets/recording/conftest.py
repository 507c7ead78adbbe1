"""The dataset that most tests of recording harm."""

from pathlib import Path

import pytest
from canned import copied
from datasets_helpers import record


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A copy of four episodes with two cameras."""
    return copied(tmp_path / "set", record, 4, cameras=True)
