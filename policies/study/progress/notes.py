"""Small JSON files that say how far a study is: there whole, or not at all."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from handrail.datasets.storage import strict_json
from handrail.datasets.storage.atomic import write_whole


def read_json(path: Path) -> dict[str, Any]:
    """Return a JSON object; an empty one if there is none."""
    try:
        content = strict_json.read_json(path)
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write a JSON object under its name at once.

    Raises:
        OSError: the disk does not take it.
    """
    write_whole(path, (json.dumps(content, indent=1) + "\n").encode())
