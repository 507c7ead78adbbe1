"""Folders of the user's own, as the XDG base directory specification has them."""

import os
from pathlib import Path

from handrail.controllers.errors import HandrailError

_USUAL = {"XDG_CACHE_HOME": "~/.cache", "XDG_CONFIG_HOME": "~/.config"}


def user_folder(variable: str) -> Path:
    """Return Handrail's folder in `$XDG_CACHE_HOME` or `$XDG_CONFIG_HOME`.

    Unset, empty or relative, the variable counts as its default: nothing lands in the current folder.

    Raises:
        HandrailError: The variable is not set, and the user has no home.
    """
    said = Path(os.environ.get(variable, ""))
    folder = said if said.is_absolute() else Path(os.path.expanduser(_USUAL[variable]))
    if not folder.is_absolute():
        raise HandrailError(f"{variable}: expected an absolute folder, for the user has no home")
    return folder / "handrail"
