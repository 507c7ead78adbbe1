"""JSON: written whole; what somebody else may have written is read small, shallow, finite, or not at all."""

import json
from pathlib import Path
from typing import Any

import msgspec

from handrail.controllers.errors import HandrailError, message_of
from handrail.controllers.regular_file import read_regular
from handrail.datasets.storage.atomic import write_whole

MOST_BYTES = 16 * 1024 * 1024
MOST_DEPTH = 50
_TOO_DEEP = f"expected JSON nested at most {MOST_DEPTH} deep, got more"


def read_json(path: Path, most: int = MOST_BYTES) -> Any:
    """Return what a file of at most so many bytes says; see `parse_json`.

    Raises:
        OSError: It is not there, cannot be read, or is no regular file.
        ValueError: `parse_json` refuses it; one line.
    """
    return parse_json(read_regular(path, most), most)


def load_json(path: Path, what: str, most: int = MOST_BYTES) -> Any:
    """Return what a file says that is no part of a dataset.

    Args:
        path: of the file.
        what: it is, for the error: `a policy of handrail-train`.
        most: bytes that it may have.
    """
    try:
        return read_json(path, most)
    except (OSError, ValueError) as error:
        raise HandrailError(f"{str(path)!r}: expected {what}, got {message_of(error)}") from error


def known_json(path: Path) -> dict[str, Any]:
    """Return the JSON object in a file; an empty one where there is none that can be read."""
    try:
        content = read_json(path)
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def write_json(path: Path, content: Any, indent: int | None = 1) -> None:
    """Write a file that `read_json` takes, whole or not at all; what is no finite number becomes null.

    Args:
        path: of the file.
        content: to write.
        indent: spaces a level; None writes one line.

    Raises:
        OSError: The disk is full, or the folder cannot be made or written.
    """
    finite = json.loads(json.dumps(content), parse_constant=lambda _: None)
    write_whole(path, (json.dumps(finite, indent=indent) + "\n").encode())


def json_bytes(content: Any) -> bytes:
    """Return JSON as LeRobot writes it, the same bytes for the same content."""
    return msgspec.json.format(json.dumps(content, ensure_ascii=False, allow_nan=False).encode(), indent=4)


def parse_json(data: bytes, most: int = MOST_BYTES) -> Any:
    """Return a JSON text as Python values.

    Raises:
        ValueError: It is no JSON, has NaN or an infinity in it, or is too large or too deep; one line.
    """
    if len(data) > most:
        raise ValueError(f"expected at most {most >> 20} MB of JSON, got more")
    try:
        content = msgspec.json.decode(data)
    except RecursionError as error:
        raise ValueError(_TOO_DEEP) from error
    _check(content, MOST_DEPTH)
    return content


def _check(value: Any, levels: int) -> None:
    """Check that nothing lies deeper than some levels, and that every whole number can be a float."""
    if isinstance(value, dict | list):
        if not levels:
            raise ValueError(_TOO_DEEP)
        for each in value.values() if isinstance(value, dict) else value:
            _check(each, levels - 1)
    elif isinstance(value, int) and abs(value) > 2**64:
        raise ValueError("a whole number beyond 2⁶⁴ is too large")
