"""One cache of recorded datasets: each is recorded once in a process, by how it is made and its settings.

root = canned(record, 4, cameras=True)                  # to look at; nobody may write to it
root = copied(tmp_path / "set", record, 4, cameras=True)  # to change
root = canned(record_by_command, "--task reach --dataset.num_episodes 1")
"""

import functools
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

_made: dict[str, Path] = {}


@functools.cache
def _folder() -> tempfile.TemporaryDirectory:
    """Return a folder that is gone when the tests are over."""
    return tempfile.TemporaryDirectory(prefix="handrail-canned-")


def canned(make: Callable[..., Any], *settings: Any, **named: Any) -> Path:
    """Return the folder that `make(folder, *settings, **named)` has written; tests only read it."""
    key = repr((make.__module__, make.__qualname__, settings, sorted(named.items())))
    if key not in _made:
        root = Path(tempfile.mkdtemp(dir=_folder().name), "set")
        make(root, *settings, **named)
        _made[key] = root
    return _made[key]


def copied(target: Path, make: Callable[..., Any], *settings: Any, **named: Any) -> Path:
    """Return a copy of a canned dataset, for a test that changes it."""
    return shutil.copytree(canned(make, *settings, **named), target)


def record_by_command(root: Path, line: str) -> None:
    """Record a dataset with `handrail-record`."""
    from command_helpers import command

    done = command(*line.split(), "--dataset.root", root)
    assert done.returncode == 0, done.stderr
