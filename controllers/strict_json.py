"""Reading JSON that somebody else may have written: of sane size and depth, finite, or one line."""

import json
import math
from pathlib import Path
from typing import Any, NoReturn

from handrail.controllers.errors import HandrailError

MOST_BYTES = 64 * 2**20
MOST_LEVELS = 64


def read_json(path: Path, what: str) -> Any:
    """Return the content of a JSON file.

    Args:
        path: of the file.
        what: it is, for the error: `a policy of handrail-train`.

    Raises:
        HandrailError: it is not there, too large or too deep, no JSON, or holds NaN or an infinite number.
    """
    where = f"{str(path)!r}: expected {what}"
    try:
        if path.stat().st_size > MOST_BYTES:
            raise HandrailError(f"{where} of at most {MOST_BYTES >> 20} MB, got {path.stat().st_size >> 20}")
        content = json.loads(path.read_bytes(), parse_constant=_not_finite)
    except RecursionError as error:
        raise HandrailError(f"{where}, got JSON nested too deeply") from error
    except (OSError, ValueError) as error:
        raise HandrailError(f"{where}, got {' '.join(str(error).split())}") from error
    _check(content, where)
    return content


def _check(content: Any, where: str) -> None:
    """Go through all levels, not by recursion: there may be too many of them."""
    level = [content]
    for _ in range(MOST_LEVELS):
        if any(isinstance(each, float) and not math.isfinite(each) for each in level):
            raise HandrailError(f"{where}, got a number that is not finite")
        level = [
            inner
            for each in level
            if isinstance(each, dict | list)
            for inner in (each.values() if isinstance(each, dict) else each)
        ]
        if not level:
            return
    raise HandrailError(f"{where}, got JSON nested too deeply")


def _not_finite(constant: str) -> NoReturn:
    raise ValueError(f"{constant}, which is no JSON")
