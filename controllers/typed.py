"""Types that check: ranges and choices stand on a field's type, and files are decoded into typed values.

A settings class with fields as `Annotated[float, Meta(ge=0)]` checks itself with `check_settings`; a table of
a file (TOML, JSON, a message) becomes a dataclass by `decoded`. Both refuse what does not fit in one line.
"""

from collections.abc import Mapping
from dataclasses import MISSING, Field, dataclass, fields, is_dataclass
from difflib import get_close_matches
from functools import cache
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import msgspec
from msgspec import Meta

from handrail.controllers.arrays import frozen
from handrail.controllers.errors import HandrailError, restated, shown

Number = Annotated[float, Meta(ge=-1e6, le=1e6)]
"""A number of a file [SI units]: beyond this it is a slip, or meant ill."""
Positive = Annotated[float, Meta(ge=1e-6, le=1e6)]
"""A number above 0, and not next to it: a limit of 5e-324 has no inverse."""
NonNegative = Annotated[float, Meta(ge=0, le=1e12)]
Fraction = Annotated[float, Meta(ge=0, le=1)]
Count = Annotated[int, Meta(ge=0, le=2**63 - 1)]
AtLeastOne = Annotated[int, Meta(ge=1, le=2**63 - 1)]
Name = Annotated[str, Meta(max_length=200, pattern=r"\A[\w+:,.\- ]*\Z")]
"""A name that can be shown and is no path, as `base+ee` or `mask:0101`."""
_HIDDEN = (  # controls, spaces that are no space, marks without a width, halves of a pair, private characters
    r"\x00-\x1f\x7f-\xa0\xad\u0600-\u0605\u061c\u06dd\u070f\u1680\u180e\u2000-\u200f\u2028-\u202f"
    r"\u205f-\u206f\u3000\ud800-\uf8ff\ufeff\ufff9-\ufffb\U000e0000-\U0010ffff"
)
Text = Annotated[str, Meta(min_length=1, max_length=200, pattern=rf"\A[^{_HIDDEN}]+\Z")]
"""A text in one line that can be seen, not empty."""


@dataclass(frozen=True)
class Listed:
    """A field's list in a file, of some type, that becomes a read-only array of floats."""

    kind: Any


_WORDS = {
    "`float`": "a number",
    "`int`": "a whole number",
    "`str`": "a text",
    "`bool`": "true or false",
    "`array`": "a list",
    "`object`": "a table",
    "`null`": "none",
}


@cache
def _types(kind: type) -> Mapping[str, Any]:
    return get_type_hints(kind, include_extras=True)


def _expected(error: msgspec.ValidationError, kind: Any) -> str:
    """Return what was expected, in words, from what the decoder says; where in a list, too."""
    said, _, path = str(error).partition(" - at ")
    if get_origin(kind) is Literal:
        return f"expected one of {', '.join(map(str, get_args(kind)))}"
    words = said.partition(", got ")[0]
    for name, word in _WORDS.items():
        words = words.replace(name, word)
    words = words[:1].lower() + words[1:]
    return words + (f" at {path.strip('`').removeprefix('$')}" if path else "")


def check(value: Any, kind: Any, where: str) -> Any:
    """Return a value of a type; lists become tuples, whole numbers become floats where the type wants it.

    Args:
        value: as it came.
        kind: the type, with its ranges.
        where: the value is, for the error.
    """
    try:
        found = msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        raise HandrailError(f"{where}: {_expected(error, kind)}, got {shown(value)}") from error
    texts = [found] if kind == Text else found if Text in get_args(kind) else ()
    if not all(text.isprintable() for text in texts):
        raise HandrailError(f"{where}: expected a text that can be printed, got {shown(value)}")
    return found


def check_settings(settings: Any, what: str = "") -> None:
    """Check the fields of a dataclass whose types have a range or a choice; `__post_init__` calls it.

    Args:
        settings: the dataclass.
        what: its fields are called in the error: `MPC setting`; `--` or `--client.` for flags.
    """
    before = what if not what or what.endswith(("--", ".")) else f"{what} "
    for name, kind in _types(type(settings)).items():
        if any(isinstance(each, Meta) for each in get_args(kind)) or get_origin(kind) is Literal:
            check(getattr(settings, name), kind, before + name)


def decoded[T](content: Any, kind: type[T], where: str) -> T:
    """Return a table of a file as a dataclass: every needed entry, no unknown one, each of its type.

    Args:
        content: the table.
        kind: the dataclass; fields that are dataclasses, tuples of them and mappings to them are tables, too.
        where: the table is, for the error.
    """
    known = {field.name: field for field in fields(kind) if field.init}  # type: ignore[arg-type]
    if not isinstance(content, Mapping):
        raise HandrailError(f"{where}: expected a table of {', '.join(known)}, got {shown(content)}")
    check_names(content, known, where)
    missing = [name for name, field in known.items() if _is_needed(field) and name not in content]
    if missing:
        raise HandrailError(f"{where}: expected an entry {missing[0]!r}, found none")
    types = _types(kind)
    values = {name: _value(content[name], types[name], f"{where}: {name}") for name in content}
    with restated(where, HandrailError):
        return kind(**values)


def check_names(content: Mapping[Any, Any], known: Mapping[str, Any], where: str) -> None:
    """Check that a table has no unknown entry; the error names the nearest that is known."""
    for name in content:
        if name not in known:
            near = get_close_matches(str(name), known, 1)
            hint = f"; nearest: {near[0]}" if near else ""
            raise HandrailError(
                f"{where}: unknown entry {shown(name)}; expected some of {', '.join(known)}{hint}"
            )


def _is_needed(field: Field[Any]) -> bool:
    return field.default is MISSING and field.default_factory is MISSING


def _value(value: Any, kind: Any, where: str) -> Any:
    inner, *marks = get_args(kind) if get_origin(kind) is Annotated else (kind,)
    if marks and isinstance(marks[0], Listed):
        return frozen(check(value, marks[0].kind, where))
    tables = [each for each in (inner, *get_args(inner)) if is_dataclass(each)]
    if not tables or (value is None and type(None) in get_args(inner)):
        return check(value, kind, where)
    if isinstance(value, tables[0]):  # type: ignore[arg-type]
        return value
    if get_origin(inner) is Mapping:
        named = check(value, dict[str, dict], where)
        return {name: decoded(each, tables[0], f"{where}.{name}") for name, each in named.items()}  # type: ignore[arg-type]
    if get_origin(inner) is not tuple:
        return decoded(value, tables[0], where)  # type: ignore[arg-type]
    listed = check(value, Annotated[(tuple[dict, ...], *marks)] if marks else tuple[dict, ...], where)
    return tuple(decoded(each, tables[0], f"{where}[{index}]") for index, each in enumerate(listed))  # type: ignore[arg-type]
