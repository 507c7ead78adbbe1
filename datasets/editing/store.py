"""Copying a dataset to an object store, or to any other file system that fsspec knows."""

from typing import Any

import fsspec

from handrail.controllers.errors import HandrailError, message_of
from handrail.datasets.editing.push import Upload

_LAST = "meta/info.json"  # without it nobody takes a folder for a dataset


def copy(push: Upload) -> None:
    """Copy what is sent to an address that is empty, or has a copy of it that was cut short."""
    try:
        system, place = fsspec.url_to_fs(push.to)
        _check_free(push, system, place)
        for name in sorted(push.files, key=lambda name: name == _LAST):
            target = f"{place.rstrip('/')}/{name}"
            system.makedirs(target.rpartition("/")[0], exist_ok=True)
            system.put_file(str(push.root / name), target)
            sizes = (push.root / name).stat().st_size, system.size(target)
            if sizes[0] != sizes[1]:
                raise OSError(f"{name} has {sizes[1]} bytes there, expected {sizes[0]}")
    except HandrailError:
        raise
    except Exception as error:  # every store fails in ways of its own
        said = f"the dataset could not be copied there: {message_of(error)}"
        raise HandrailError(f"--to {push.to}: {said}") from error


def _check_free(push: Upload, system: Any, place: str) -> None:
    system.invalidate_cache()
    found = system.find(place) if system.exists(place) else []
    names = {path.removeprefix(place.rstrip("/") + "/") for path in found}
    if _LAST in names or not names <= set(push.files):
        raise HandrailError(
            f"--to {push.to}: expected nothing there, or a copy of this dataset that was cut short; found"
            f" {len(names)} files; choose another place"
        )
