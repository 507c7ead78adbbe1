"""Whether a robot's description file can be a robot's: what each entry has to be, and what fits together."""

import itertools
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from handrail.controllers.entries import (
    Entry,
    check_entries,
    is_number,
    is_positive,
    is_table,
    is_text,
    lists,
)
from handrail.controllers.errors import HandrailError, shown

_BASE_SIZES = {"planar": 3, "fixed": 0}
_SHAPES: Mapping[str, tuple[str, Callable[[Any], bool]]] = {
    "box": ("three lengths above 0 [m]", lists(is_positive, 3)),
    "capsule": ("a radius above 0 [m]", is_positive),
    "cylinder": ("radius and length above 0 [m]", lists(is_positive, 2)),
    "sphere": ("a radius above 0 [m]", is_positive),
}


def _vector(needed: bool = False) -> Entry:
    return Entry("three numbers", lists(is_number, 3), needed)


def _positive(unit: str) -> Entry:
    return Entry(f"a number above 0 [{unit}]", is_positive)


def _range(fits: Callable[[Any], bool], unit: str) -> Entry:
    def rises(value: Any) -> bool:
        return lists(fits, 2)(value) and value[0] <= value[1]

    return Entry(f"the lowest and the highest, {unit}", rises, needed=False)


def _is_colour(value: Any) -> bool:
    return lists(is_number)(value) and len(value) in (3, 4) and all(0 <= share <= 1 for share in value)


def _is_pair(value: Any) -> bool:
    """Return whether a value is two names, and the largest margin that the two can keep."""
    if not isinstance(value, list) or len(value) not in (2, 3):
        return False
    return (
        all(map(is_text, value[:2]))
        and value[0] != value[1]
        and all(is_number(m) and m >= 0 for m in value[2:])
    )


def _is_names(value: Any) -> bool:
    return isinstance(value, list) and all(map(is_text, value)) and len(set(value)) == len(value)


_TABLES: Mapping[str, Mapping[str, Entry]] = {
    "base": {
        "kind": Entry("planar or fixed", lambda value: isinstance(value, str) and value in _BASE_SIZES),
        "mass": _positive("kg"),
        "height": Entry("a number, 0 or more [m]", lambda value: is_number(value) and value >= 0),
        "size": Entry("two lengths above 0 [m]", lists(is_positive, 2)),
    },
    "arm": {
        "urdf": Entry("a path inside a package, or beside the description", is_text),
        "joints": Entry("names, each once", lambda value: _is_names(value) and bool(value)),
        "translation": _vector(),
        "rpy": _vector(),
    },
    "tool": {"frame": Entry("a name", is_text), "translation": _vector(), "rpy": _vector()},
    "home": {"q": Entry("numbers", lists(is_number))},
    "limits": {
        "position_lower": Entry("numbers", lists(is_number)),
        "position_upper": Entry("numbers", lists(is_number)),
        **{
            name: Entry("numbers above 0", lists(is_positive))
            for name in ("velocity", "acceleration", "effort", "servo")
        },
    },
    "gripper": {
        "frame": Entry("a name", is_text),
        "translation": _vector(),
        "rpy": _vector(),
        "shape": Entry("a name", is_text, needed=False),
        "mass": _positive("kg"),
        "finger_mass": _positive("kg"),
        "finger_size": Entry("three lengths above 0 [m]", lists(is_positive, 3)),
        "stroke": _positive("m"),
        "tip": _positive("m"),
        "force": _positive("N"),
        "speed": _positive("m/s"),
        "friction": _positive("1"),
        "camera": _vector(needed=True),
        "camera_tilt": Entry("a number [rad]", is_number),
        "jaw": Entry("a table", is_table, needed=False),
    },
    "world": {
        **{name: Entry("a number above 0", is_positive, needed=False) for name in ("scale", "pace")},
        **{name: _range(is_positive, "above 0 [m]") for name in ("tables", "goals")},
        **{name: _range(is_number, "[rad]") for name in ("pitch", "roll")},
        "cube": Entry("a length above 0 [m]", is_positive, needed=False),
    },
    "self_collision": {
        "pairs": Entry(
            "pairs of names, and of some the largest margin, 0 or more [m]",
            lambda value: isinstance(value, list) and all(map(_is_pair, value)),
        ),
    },
}
_JAW: Mapping[str, Entry] = {
    "frame": Entry("a name", is_text),
    **{name: Entry("a number [rad]", is_number) for name in ("closed", "open", "parallel")},
    "gap": _positive("m"),
}
_OPTIONAL = ("gripper", "world")
_WHOLE: Mapping[str, Entry] = {
    "name": Entry("a name", is_text),
    **{name: Entry("a table", is_table, needed=name not in _OPTIONAL) for name in _TABLES},
    "collision": Entry("tables of shapes", lists(is_table)),
    "visual": Entry("tables of shapes", lists(is_table), needed=False),
}


def check_description(content: Mapping[str, Any], where: str) -> None:
    """Check what a robot's description file says.

    Args:
        content: of the file.
        where: it is, for the error.
    """
    check_entries(content, _WHOLE, where)
    for name, entries in _TABLES.items():
        if name in content:
            check_entries(content[name], entries, f"{where}: [{name}]")
    _check_jaw(content.get("gripper", {}).get("jaw"), f"{where}: [gripper.jaw]")
    for kind in ("collision", "visual"):
        for number, shape in enumerate(content.get(kind, ()), start=1):
            name = shape["name"] if is_text(shape.get("name")) else number
            _check_shape(shape, f"{where}: {name} of [[{kind}]]", kind == "collision")
    _check_joints(content, where)
    _check_names(content, where)


def _check_jaw(jaw: Mapping[str, Any] | None, where: str) -> None:
    if jaw is None:
        return
    check_entries(jaw, _JAW, where)
    if not jaw["closed"] <= jaw["parallel"] < jaw["open"]:
        got = ", ".join(f"{name} {jaw[name]}" for name in ("closed", "parallel", "open"))
        raise HandrailError(f"{where}: expected closed <= parallel < open, got {got}")


def _check_shape(shape: Mapping[str, Any], where: str, named: bool) -> None:
    kinds = [kind for kind in _SHAPES if kind in shape]
    if len(kinds) != 1:
        raise HandrailError(
            f"{where}: expected one of {', '.join(_SHAPES)}, got {' and '.join(kinds) or 'none'}"
        )
    (kind,) = kinds
    capsule = kind == "capsule"
    places = {"a": _vector(True), "b": _vector(True)} if capsule else {"at": _vector(), "rpy": _vector()}
    common = {
        "name": Entry("a name", is_text, needed=named),
        "frame": Entry("a name", is_text),
        kind: Entry(*_SHAPES[kind]),
        "tool": Entry("true or false", lambda value: isinstance(value, bool), needed=False),
        "rgba": Entry("three or four numbers from 0 to 1", _is_colour, needed=False),
    }
    check_entries(shape, common | places, where)
    if capsule and shape["a"] == shape["b"]:
        raise HandrailError(
            f"{where}: expected a and b apart, got {shape['a']} twice; a sphere has no length"
        )


def _check_joints(content: Mapping[str, Any], where: str) -> None:
    """Check that there is one number a joint, and that home lies inside the limits."""
    base, limits = content["base"]["kind"], content["limits"]
    size = _BASE_SIZES[base] + len(content["arm"]["joints"])
    for name, values in {
        "home: q": content["home"]["q"],
        **{f"limits: {k}": v for k, v in limits.items()},
    }.items():
        if len(values) != size:
            raise HandrailError(f"{where}: {name}: expected {size} numbers, one a joint, got {len(values)}")
    triples = zip(limits["position_lower"], content["home"]["q"], limits["position_upper"], strict=True)
    for number, (lower, home, upper) in enumerate(triples, start=1):
        if not lower < upper:
            raise HandrailError(
                f"{where}: limits of joint {number}: expected position_lower below position_upper, "
                f"got {lower} and {upper}"
            )
        if not lower <= home <= upper:
            raise HandrailError(f"{where}: home of joint {number}: expected {lower} to {upper}, got {home}")


def _check_names(content: Mapping[str, Any], where: str) -> None:
    """Check that shapes have names of their own, and that no others are used."""
    names = [shape["name"] for shape in content["collision"]]
    if twice := [name for name in names if names.count(name) > 1]:
        raise HandrailError(f"{where}: [[collision]]: expected each name once, got {twice[0]!r} twice")
    pairs = [frozenset(pair[:2]) for pair in content["self_collision"]["pairs"]]
    if twice := [pair for pair in pairs if pairs.count(pair) > 1]:
        raise HandrailError(
            f"{where}: pairs: expected each pair once, got {', '.join(sorted(twice[0]))} twice"
        )
    for name in _used(content):
        if name not in names:
            raise HandrailError(
                f"{where}: collision shape {shown(name)}: expected one of {', '.join(sorted(names))}"
            )


def _used(content: Mapping[str, Any]) -> Iterator[str]:
    """Yield the names of collision shapes that pairs and gripper name."""
    yield from itertools.chain.from_iterable(pair[:2] for pair in content["self_collision"]["pairs"])
    if "gripper" in content:
        yield content["gripper"].get("shape", "fingers")
