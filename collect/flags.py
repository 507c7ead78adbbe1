"""Helpers for the settings of several commands: two ways to say one thing, names from a list, a file."""

from collections.abc import Collection
from pathlib import Path
from typing import Any

import tyro

from handrail.controllers.errors import HandrailError, unknown_name
from handrail.controllers.registry import Registry
from handrail.datasets.storage.atomic import check_room


def only_one[Given](place: Given, flagged: Given, flag: str) -> Given:
    """Return what was given: without a flag, or with it, which says the same."""
    if place and flagged:
        raise HandrailError(f"{_shown(place)} and {flag} {_shown(flagged)}: expected one of them, got both")
    return place or flagged


def _shown(given: object) -> str:
    return " ".join(map(str, given)) if isinstance(given, tuple) else str(given)


def one_of(registry: Registry[Any]) -> object:
    """Return what lists a registry's names in the help of a flag, those of installed packages too."""
    return tyro.conf.arg(
        help_behavior_hint=lambda default: (
            f"(default: {default}. {registry.help}; or module:name of another package)"
        )
    )


def names(given: str, everything: Collection[str]) -> tuple[str, ...]:
    """Return the names in a comma-separated list, or everything where it says `all`."""
    if given.strip() == "all":
        return tuple(everything)
    return tuple(name.strip() for name in given.split(",") if name.strip())


def check_names(thing: str, flag: str, chosen: tuple[str, ...], choices: Collection[str]) -> None:
    """Check that names were chosen, that each may be, and each is there once."""
    if not chosen:
        raise HandrailError(f"{flag}: expected all, or some of {', '.join(choices)}; got none")
    for name in chosen:
        fits = choices.accepts if isinstance(choices, Registry) else choices.__contains__
        if not fits(name):
            raise unknown_name(thing, name, ("all", *choices))
    if len(set(chosen)) != len(chosen):
        raise HandrailError(f"{flag} {','.join(chosen)}: expected each {thing} once")


def check_file(flag: str, file: str, ending: str = "") -> None:
    """Check that a file can be written, if one is asked for."""
    if not file:
        return
    path = Path(file).expanduser().absolute()
    if not file.endswith(ending) or path.is_dir() or not path.parent.is_dir():
        raise HandrailError(f"{flag} {file}: expected a {f'{ending} file'.strip()} in an existing folder")
    check_room(f"{flag} {file}", path.parent)
