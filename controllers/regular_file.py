"""A file that somebody else may have placed: a regular one, or one line; opening it never waits."""

import errno
import os
import stat
from io import BufferedReader
from pathlib import Path

_KINDS = {
    **{stat.S_IFIFO: "a named pipe", stat.S_IFSOCK: "a socket", stat.S_IFDIR: "a folder"},
    **{stat.S_IFCHR: "a device", stat.S_IFBLK: "a device"},
}


def regular(path: Path) -> Path:
    """Return the path of a regular file, or of a link to one, for a library that opens it.

    Raises:
        OSError: It is not there, or something else: opening a named pipe would wait for ever.
    """
    kind = stat.S_IFMT(os.stat(path).st_mode)
    if kind != stat.S_IFREG:
        found = _KINDS.get(kind, "something else")
        raise OSError(errno.EINVAL, f"expected a regular file, found {found}", str(path))
    return path


def open_regular(path: Path) -> BufferedReader:
    """Open a regular file to read it.

    Raises:
        OSError: It is not there, cannot be read, or is no regular file.
    """
    return open(regular(path), "rb")


def read_regular(path: Path, most: int) -> bytes:
    """Return the content of a regular file of at most so many bytes.

    Raises:
        OSError: It is not there, cannot be read, or is no regular file.
        ValueError: It is larger.
    """
    with open_regular(path) as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise ValueError(f"expected at most {most >> 20} MB, got more")
    return data


def is_inside(path: Path, folder: Path) -> bool:
    """Return whether a path lies in a folder, wherever links lead; one that leads to itself stays there."""
    return Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder))
