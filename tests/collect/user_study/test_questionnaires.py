"""NASA-TLX and SUS equal what is computed by hand; what was not answered is never made up."""

import re
from dataclasses import fields

import numpy as np
import pytest
from places import ROOT

from handrail.collect.user_study.items import LONGEST_TEXT, Item
from handrail.collect.user_study.questionnaires import (
    PAIRS,
    SCALES,
    STATEMENTS,
    pairs_form,
    scales_form,
    sus_form,
    sus_score,
    tlx_raw,
    tlx_weighted,
)
from handrail.controllers.errors import HandrailError

RATINGS = dict(zip(SCALES, (80, 10, 60, 25, 70, 55), strict=True))
# mental beats all (5), temporal 4, effort 3, frustration 2, performance 1, physical 0: in all 15
RANK = ("mental", "temporal", "effort", "frustration", "performance", "physical")
CHOSEN = {"_".join(pair): min(pair, key=RANK.index) for pair in PAIRS}


def test_tlx_by_hand():
    assert tlx_raw(RATINGS) == 50.0  # (80 + 10 + 60 + 25 + 70 + 55) / 6
    # (5·80 + 0·10 + 4·60 + 1·25 + 3·70 + 2·55) / 15
    assert tlx_weighted(RATINGS, CHOSEN) == pytest.approx(985 / 15)
    assert tlx_weighted(dict.fromkeys(SCALES, 45), CHOSEN) == 45.0


def test_sus_by_hand():
    assert sus_score(dict(zip(STATEMENTS, (5, 1) * 5, strict=True))) == 100.0
    assert sus_score(dict.fromkeys(STATEMENTS, 3)) == 50.0
    # odd: 4 3 5 2 4 → 3+2+4+1+3 = 13; even: 2 4 1 3 2 → 3+1+4+2+3 = 13; 26 × 2.5
    assert sus_score(dict(zip(STATEMENTS, (4, 2, 3, 4, 5, 1, 2, 3, 4, 2), strict=True))) == 65.0


@pytest.mark.parametrize("name", SCALES)
def test_a_scale_that_was_not_answered_leaves_the_scores_empty(name):
    assert tlx_raw({**RATINGS, name: None}) is None
    assert tlx_weighted({**RATINGS, name: None}, CHOSEN) is None
    assert tlx_raw({key: value for key, value in RATINGS.items() if key != name}) is None


def test_a_comparison_or_a_statement_that_was_not_answered_leaves_the_score_empty():
    assert tlx_weighted(RATINGS, {**CHOSEN, "mental_physical": None}) is None
    assert tlx_weighted(RATINGS, {}) is None
    assert sus_score({**dict.fromkeys(STATEMENTS, 3), "q10": None}) is None


def test_tlx_asks_what_the_form_asks():
    scales = scales_form()
    assert [item.name for item in scales.items] == list(SCALES)
    for item in scales.items:
        taken = [value for value in range(-5, 106) if fits(item, value)]
        assert taken == list(range(0, 101, 5))
        assert item.low == ("perfect" if item.name == "performance" else "very low")
    forms = [pairs_form(np.random.default_rng(seed)) for seed in (0, 0, 1)]
    assert forms[0] == forms[1] != forms[2]
    assert {frozenset(dict(item.choices)) for item in forms[0].items} == set(map(frozenset, PAIRS))
    assert len(forms[0].items) == 15
    first = [item.choices[0][0] == min(dict(item.choices), key=SCALES.index) for item in forms[0].items]
    assert 0 < sum(first) < 15  # sides change


def test_sus_has_ten_statements_from_1_to_5():
    for item in sus_form().items:
        assert [value for value in range(-1, 8) if fits(item, value)] == [1, 2, 3, 4, 5]
    assert len(sus_form().items) == 10


def fits(item, value):
    try:
        return item.check(value) == value
    except HandrailError:
        return False


ITEMS = {
    "scale": Item("a", "scale", "?", step=5),
    "likert": Item("a", "likert", "?", least=1, most=7),
    "number": Item("a", "number", "?", least=0, most=10),
    "choice": Item("a", "choice", "?", choices=(("x", "X"), ("y", "Y"))),
    "text": Item("a", "text", "?"),
}
ODD = (
    True,
    "5",
    5.5,
    float("nan"),
    float("inf"),
    -1,
    10**9,
    "",
    " ",
    "x" * (LONGEST_TEXT + 1),
    "\ud800",
    "\x00",
)


@pytest.mark.parametrize("kind", ITEMS)
def test_an_answer_that_is_none_is_refused_in_one_line(kind):
    allowed = {"number": (5.5,), "text": ("5",)}.get(kind, ())
    for value in ODD:
        if value not in allowed:
            with pytest.raises(HandrailError, match=r"answer to a: expected .*, got "):
                ITEMS[kind].check(value)
    assert ITEMS[kind].check(None) is None
    with pytest.raises(HandrailError):
        Item("consent", "choice", "?", choices=(("yes", ""), ("no", "")), declines=False).check(None)


def test_the_page_reads_no_field_that_an_item_lacks():
    page = (ROOT / "collect" / "cockpit" / "page" / "form.js").read_text()
    read = set(re.findall(r"\bitem\.(\w+)", page)) - {"box"}  # which the page adds
    assert {"kind", "longest"} <= read <= {field.name for field in fields(Item)}
