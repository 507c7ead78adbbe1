"""Types that check: a value of a type's range comes back equal; every other is one line that says where."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import Meta

from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.typed import (
    AtLeastOne,
    Count,
    Fraction,
    Listed,
    Name,
    NonNegative,
    Number,
    Positive,
    Text,
    check,
    check_settings,
    decoded,
)

RANGES = {Number: (-1e6, 1e6), Positive: (1e-6, 1e6), NonNegative: (0.0, 1e12), Fraction: (0.0, 1.0)}
WHOLE = {Count: 0, AtLeastOne: 1}


@dataclass(frozen=True)
class Inner:
    size: Positive
    kind: Literal["a", "b"] = "a"

    def __post_init__(self) -> None:
        if self.size == 13.0:
            raise HandrailError("expected another size")


@dataclass(frozen=True)
class Table:
    name: Text
    inner: Inner
    several: Annotated[tuple[Inner, ...], Meta(min_length=1)]
    array: Annotated[FloatArray, Listed(tuple[Number, ...])]
    perhaps: Inner | None = None
    shares: Mapping[str, Fraction] | None = None


GOOD = {
    "name": "x",
    "inner": {"size": 1.0},
    "several": [{"size": 1.0}, {"size": 2, "kind": "b"}],
    "array": [1, 2.5],
}


def refused(call, *parts) -> None:
    with pytest.raises(HandrailError) as raised:
        call()
    assert str(raised.value).isprintable()
    assert all(part in str(raised.value) for part in parts), str(raised.value)


@pytest.mark.parametrize("kind", RANGES)
@given(data=st.data())
def test_a_number_in_its_range_comes_back_and_no_other(kind, data):
    low, high = RANGES[kind]
    value = data.draw(st.floats(low, high) | st.integers(math.ceil(low), math.floor(high)))
    assert check(value, kind, "x") == value
    outside = st.floats().filter(lambda value: not low <= value <= high)
    strange = st.sampled_from([math.nan, math.inf, -math.inf, 10**400, True, False, None, "1", [1.0], {}])
    wrong = data.draw(outside | strange)
    refused(lambda: check(wrong, kind, "size"), "size: ")


@pytest.mark.parametrize("kind", WHOLE)
@given(data=st.data())
def test_a_whole_number_comes_back_and_no_other(kind, data):
    value = data.draw(st.integers(WHOLE[kind], 2**63 - 1))
    assert check(value, kind, "x") == value
    wrong = data.draw(
        st.integers(max_value=WHOLE[kind] - 1) | st.integers(2**63) | st.sampled_from([True, 1.5, "1", None])
    )
    refused(lambda: check(wrong, kind, "count"), "count: ")


@given(st.text(max_size=300) | st.text("ab_+:,.- ", max_size=5))
def test_texts_and_names_can_be_shown(text):
    seen = 0 < len(text) <= 200 and not any(c in text for c in "\n\r\0\x7f\x85\xa0\u200b\u2028\u2029\ue000")
    if seen and text.isprintable():
        assert check(text, Text, "x") == text
    elif not seen:
        refused(lambda: check(text, Text, "title"), "title: ")
    if len(text) <= 200 and all(c.isalnum() or c in "_+:,.- " for c in text):
        assert check(text, Name, "x") == text
    elif len(text) > 200 or any(c in text for c in "/\\\n\0"):
        refused(lambda: check(text, Name, "title"), "title: ")


def test_tables_in_tables_come_back():
    found = decoded(GOOD | {"perhaps": {"size": 3.0}, "shares": {"a": 0.5}}, Table, "f")
    assert found.inner == Inner(1.0)
    assert found.several == (Inner(1.0), Inner(2.0, "b"))
    assert (found.perhaps, found.shares) == (Inner(3.0), {"a": 0.5})
    np.testing.assert_array_equal(found.array, [1.0, 2.5])
    assert not found.array.flags.writeable
    assert decoded(GOOD, Table, "f").perhaps is None


@pytest.mark.parametrize(
    ("change", "parts"),
    [
        ({"nmae": "x"}, ("f: unknown entry 'nmae'", "nearest: name")),
        ({"inner": {}}, ("f: inner: expected an entry 'size', found none",)),
        ({"inner": 3}, ("f: inner: expected a table of size, kind, got 3",)),
        ({"inner": {"size": 1.0, "sort": 1}}, ("f: inner: unknown entry 'sort'",)),
        ({"inner": {"size": 1.0, "kind": "c"}}, ("f: inner: kind: expected one of a, b, got 'c'",)),
        ({"inner": {"size": 13.0}}, ("f: inner: expected another size",)),
        ({"perhaps": {"size": math.nan}}, ("f: perhaps: size:",)),
        ({"several": [{"size": 1.0}, {"size": 0.0}]}, ("f: several[1]: size:",)),
        ({"several": []}, ("f: several:",)),
        ({"several": {"size": 1.0}}, ("f: several:", "a list")),
        ({"several": [1]}, ("f: several:", "[0]")),
        ({"shares": {"a": 1.5}}, ("f: shares:",)),
        ({"array": [1.0, True]}, ("f: array:", "[1]")),
        ({"name": "a\nb"}, ("f: name:",)),
    ],
)
def test_a_misfit_is_one_line_that_names_the_place(change, parts):
    refused(lambda: decoded(GOOD | change, Table, "f"), *parts)


@pytest.mark.parametrize("content", [None, 1, "x", [GOOD]])
def test_data_that_are_no_table_are_refused(content):
    refused(lambda: decoded(content, Table, "f"), "f: expected a table of name, inner")


def test_settings_check_their_own_ranges():
    check_settings(Inner(1.0), "setting")
    refused(lambda: check_settings(Inner(-1.0), "setting"), "setting size:", "-1.0")
    refused(lambda: check_settings(Inner(1.0, "c"), "setting"), "setting kind: expected one of a, b")
