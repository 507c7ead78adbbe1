"""Law: where the cockpit's extra is not installed, one line says how it is, and nothing is written."""

import importlib.util

import pytest
from command_helpers import refused


@pytest.mark.parametrize("missing", ["uvicorn", "starlette"])
def test_a_missing_package_is_named(tmp_path, monkeypatch, missing):
    found = importlib.util.find_spec
    with monkeypatch.context() as patch:
        patch.setattr(importlib.util, "find_spec", lambda name: None if name == missing else found(name))
        line = refused(tmp_path / "d", "--no_physics", "--cockpit.no_open", name="cockpit")
    assert f"expected {missing}, found none" in line
    assert ".[cockpit]" in line
    assert not (tmp_path / "d").exists()
