"""The user's folders for caches and settings."""

from pathlib import Path

import pytest

from handrail.controllers.errors import HandrailError
from handrail.controllers.user_folder import user_folder


@pytest.mark.parametrize("variable", ["XDG_CACHE_HOME", "XDG_CONFIG_HOME"])
def test_only_an_absolute_folder_replaces_the_default(variable, tmp_path, monkeypatch):
    """Empty means unset, and relative ones are to be ignored, says the specification."""
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv(variable, str(tmp_path / "mine"))
    assert user_folder(variable) == tmp_path / "mine" / "handrail"
    usual = tmp_path / {"XDG_CACHE_HOME": ".cache", "XDG_CONFIG_HOME": ".config"}[variable] / "handrail"
    for said in ("", "here", "./here"):
        monkeypatch.setenv(variable, said)
        assert user_folder(variable) == usual
    monkeypatch.delenv(variable)
    assert user_folder(variable) == usual
    assert not list(Path(tmp_path).iterdir())
    monkeypatch.setattr("os.path.expanduser", str)  # as where nobody knows a home
    with pytest.raises(HandrailError, match=f"{variable}: expected an absolute folder"):
        user_folder(variable)
