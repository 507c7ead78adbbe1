"""Reading TOML that somebody else may have written: of sane size and depth, or one line."""

import tomllib
from pathlib import Path
from typing import Any

from handrail.controllers.errors import HandrailError, message_of
from handrail.controllers.regular_file import read_regular

MOST_BYTES = 2**20


def read_toml(path: Path, what: str) -> dict[str, Any]:
    """Return the content of a TOML file.

    Args:
        path: of the file.
        what: it is, for the error: `robot description`.
    """
    try:
        return tomllib.loads(read_regular(path, MOST_BYTES).decode())
    except RecursionError as error:
        raise HandrailError(f"{what} {path}: not valid TOML: nested too deeply") from error
    except (OSError, ValueError) as error:
        raise HandrailError(f"{what} {path}: not valid TOML: {message_of(error)}") from error
