"""Patterns of paths in `info.json`, such as `data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet`.

A dataset may come from a stranger, and `str.format` would look up attributes, pad to gigabytes and leave the
dataset's folder for them. Only plain fields with a short width are filled in, and the path must stay inside.
"""

import re
import string
from pathlib import PurePosixPath

_NUMBER = re.compile(r"(?:0?[1-9])?d?")  # at most nine digits wide
_NAMES = ("chunk_index", "file_index", "video_key")
_LONGEST = 1000  # [characters]


def check_pattern(pattern: object, names: tuple[str, ...]) -> str:
    """Return a pattern that `fill` takes.

    Args:
        pattern: What `info.json` says.
        names: The fields that it may have.

    Raises:
        ValueError: It is no text, has other fields, or leaves the folder; one line.
    """
    if not isinstance(pattern, str) or not 0 < len(pattern) <= _LONGEST:
        raise ValueError(f"expected a pattern of a path, got {str(pattern)[:60]!r}")
    for _, name, width, conversion in string.Formatter().parse(pattern):
        if name is not None and (name not in names or conversion or not _NUMBER.fullmatch(width or "")):
            raise ValueError(f"expected only {', '.join(names)} in a path, got {pattern[:60]!r}")
    fill(pattern, 0, 0, "key")
    return pattern


def fill(pattern: str, chunk_index: int, file_index: int, video_key: str = "") -> str:
    """Return the path of a checked pattern, relative to the dataset.

    Raises:
        ValueError: It leaves the dataset's folder.
    """
    values = dict(zip(_NAMES, (chunk_index, file_index, video_key), strict=True))
    return inside(pattern.format(**values))


def inside(path: str) -> str:
    """Return a path relative to a dataset.

    Raises:
        ValueError: It leaves the dataset's folder.
    """
    if PurePosixPath(path).is_absolute() or ".." in re.split(r"[/\\]", path) or "\0" in path:
        raise ValueError(f"expected a path inside the dataset, got {path[:60]!r}")
    return path
