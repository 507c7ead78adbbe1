"""The few ways in which Handrail changes a disk: a file is there whole, under its name, or not at all.

A file is written under a temporary name on the same file system, synced, renamed, and the folder synced.
"""

import contextlib
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

from handrail.controllers.errors import HandrailError


@contextlib.contextmanager
def explained(what: str) -> Iterator[None]:
    """Turn an error of the operating system into one line that says what failed."""
    try:
        yield
    except OSError as error:
        raise HandrailError(f"{what}: {reason(error)}") from error


def reason(error: Exception) -> str:
    """Return why something failed, in the words of the operating system where it has any."""
    return getattr(error, "strerror", None) or str(error)


def followed(path: str | Path) -> Path:
    """Return where a path leads: what is behind a link is changed, and the link stays."""
    return Path(os.path.realpath(Path(path).expanduser()))


def beside(path: Path, ending: str) -> Path:
    """Return the hidden name of what is not finished, beside a file or a folder."""
    if not path.name:
        raise HandrailError(f"{str(path)!r}: expected a folder with a name, got the top of all folders")
    return path.with_name(f".{path.name}.{ending}")


def check_room(what: str, path: Path) -> None:
    """Check that a folder is there or can be made, and can be written; `what` begins the error."""
    existing = next(each for each in (path, *path.absolute().parents) if os.path.lexists(each))
    if not existing.is_dir():
        kind = "a file" if existing.exists() else "a link to nowhere"
        raise HandrailError(f"{what}: expected a folder, but {str(existing)!r} is {kind}")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise HandrailError(f"{what}: expected a folder that can be written, but {str(existing)!r} cannot")


def write_synced(path: Path, data: bytes) -> None:
    """Write a file and wait until the disk has it.

    Raises:
        OSError: The disk is full, or the folder is missing or not writable.
    """
    path.unlink(missing_ok=True)  # a link that lies there leads to somebody else's file
    with open(path, "wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())


def sync(path: Path) -> None:
    """Wait until the disk has a file that something else has written, or the names in a folder."""
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)  # a named pipe would wait
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def make_folder(path: Path) -> None:
    """Create a folder and those above it, each name synced into its parent."""
    if path.is_dir():
        return
    make_folder(path.parent)
    path.mkdir(exist_ok=True)
    sync(path.parent)


def write_whole(path: Path, data: bytes, staging: Path | None = None) -> None:
    """Write or replace a file so that a reader sees the old one or the new one, whole.

    Args:
        path: The file.
        data: Its content.
        staging: A folder of the same file system for what is not whole yet, which lies beside it without.

    Raises:
        OSError: The disk is full, or the folder cannot be made or written; nothing else is left behind.
    """
    make_folder(path.parent)
    partial = staging / path.name if staging else beside(path, "partial")
    try:
        write_synced(partial, data)
        os.replace(partial, path)
    except BaseException:
        partial.unlink(missing_ok=True)
        raise
    sync(path.parent)


def publish_folder(draft: Path, final: Path, replacing: bool = True) -> None:
    """Give a finished folder its name, with everything in it on the disk.

    One that is replaced is renamed first and removed last, so that one of the two is always there whole.

    Args:
        draft: The folder.
        final: Its name.
        replacing: Whether a folder of that name is replaced; without, it must be missing or empty.

    Raises:
        OSError: The disk does not take it, or somebody else has made a folder of that name meanwhile.
    """
    for path in (draft, *draft.rglob("*")):
        if not path.is_symlink():  # what is behind it is somebody else's, or nothing
            sync(path)
    old = beside(final, "replaced")
    if replacing:
        remove(old)
        if final.exists():
            os.replace(final, old)
    os.replace(draft, final)
    sync(final.parent)
    shutil.rmtree(old, ignore_errors=True)  # it is done; the next edit names what is left


def move(source: Path, target: Path) -> None:
    """Rename a file into another folder of the same file system, durably."""
    make_folder(target.parent)
    os.replace(source, target)
    sync(target.parent)


def remove(path: Path) -> None:
    """Remove a file, a link or a whole folder; what is not there is fine."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
