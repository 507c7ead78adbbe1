"""What property tests put into TOML files: other kinds of values, entries that are gone or unknown."""

import math
import tomllib

from hypothesis import strategies as st

NUMBERS = st.one_of(
    st.floats(), st.integers(-(10**25), 10**25), st.sampled_from([0, -1, 1e-300, 1e300, 10**400])
)
JUNK = st.recursive(
    st.one_of(
        NUMBERS, st.booleans(), st.text(max_size=5), st.sampled_from(["chassis", "tool0", "../x", "planar"])
    ),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(min_size=1, max_size=4), inner, max_size=3)
    ),
    max_leaves=6,
)


def toml(value) -> str:
    """Return a value as TOML, tables in one line."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return (
            str(value)
            if math.isfinite(value)
            else ("nan" if math.isnan(value) else "inf" if value > 0 else "-inf")
        )
    if isinstance(value, str):
        return (
            '"' + "".join(f"\\U{ord(c):08x}" if not 0xD800 <= ord(c) < 0xE000 else "?" for c in value) + '"'
        )
    if isinstance(value, dict):
        return "{" + ", ".join(f"{toml(key)} = {toml(each)}" for key, each in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return str(value)


def places(value, here=()):
    """Yield the place of everything in a file."""
    if here:
        yield here
    pairs = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, each in pairs:
        yield from places(each, (*here, key))


def changed(content, place, value, remove):
    """Change or remove what is at a place of a file's content, which is changed."""
    *above, last = place
    for key in above:
        content = content[key]
    if remove:
        del content[last]
    else:
        content[last] = value


def mutated(text: str, data: st.DataObject) -> str:
    """Return a file with an entry or two changed or gone, and perhaps one that nobody knows."""
    content = tomllib.loads(text)
    for _ in range(data.draw(st.integers(1, 2))):
        if there := sorted(places(content), key=str):
            changed(content, data.draw(st.sampled_from(there)), data.draw(JUNK), data.draw(st.booleans()))
    content |= data.draw(st.dictionaries(st.text(min_size=1, max_size=3), JUNK, max_size=1))
    return "\n".join(f"{toml(key)} = {toml(value)}" for key, value in content.items())


def spoilt(text: str, data: st.DataObject, most: int) -> bytes:
    """Return a file of which at most so many bytes somewhere are others."""
    first, last = sorted(data.draw(st.integers(0, len(text.encode()))) for _ in range(2))
    return text.encode()[:first] + data.draw(st.binary(max_size=8)) + text.encode()[min(last, first + most) :]
