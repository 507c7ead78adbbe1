"""Flags that few people need: `--help` leaves them out, `--help-all` shows them."""

from dataclasses import field, fields, is_dataclass, make_dataclass
from typing import Annotated, Any, TypeVar, get_type_hints

T = TypeVar("T")
_MARK = object()

Advanced = Annotated[T, _MARK]
"""A setting that few people need."""


def without_advanced[Config](config: type[Config]) -> type[Config]:
    """Return settings whose command line has no advanced flags: for the help, which reads docstrings."""
    import tyro

    hints = get_type_hints(config, include_extras=True)
    changed: list[tuple[str, Any, Any]] = []
    for each in fields(config):  # pyright: ignore[reportArgumentType]
        hint = hints[each.name]
        if _MARK in getattr(hint, "__metadata__", ()):
            same = field(default=each.default, default_factory=each.default_factory, kw_only=each.kw_only)
            changed.append((each.name, tyro.conf.Suppress[hint], same))
        elif is_dataclass(hint) and (part := without_advanced(hint)) is not hint:  # pyright: ignore
            changed.append((each.name, part, field(default_factory=part)))
    if not changed:
        return config
    return make_dataclass(config.__name__, changed, bases=(config,), frozen=True)
