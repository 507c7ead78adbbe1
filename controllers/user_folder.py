"""Folders of the user's own, as the XDG base directory specification has them."""

import os
from pathlib import Path

_USUAL = {"XDG_CACHE_HOME": "~/.cache", "XDG_CONFIG_HOME": "~/.config"}


def user_folder(variable: str) -> Path:
    """Return Handrail's folder in `$XDG_CACHE_HOME` or `$XDG_CONFIG_HOME`.

    Unset, empty or relative, the variable counts as its default: nothing lands in the current folder.
    """
    said = Path(os.environ.get(variable, ""))
    return (said if said.is_absolute() else Path(_USUAL[variable]).expanduser()) / "handrail"
