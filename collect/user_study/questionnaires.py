"""NASA-TLX, the workload of a condition as its participant rates and weighs it, and SUS, its usability.

S. G. Hart, L. E. Staveland, Development of NASA-TLX (Task Load Index): results of empirical and theoretical
research, Advances in Psychology 52 (1988), 139-183. Scales and words are those of NASA's own form.
J. Brooke, SUS: a "quick and dirty" usability scale, Usability Evaluation in Industry (1996), 189-194.
"""

from collections.abc import Mapping
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from handrail.collect.user_study.items import Answer, Form, Item
from handrail.controllers.strict_toml import read_toml

TLX, TLX_PAIRS, SUS = "tlx", "tlx_pairs", "sus"
_WORDS: Mapping[str, Any] = read_toml(Path(__file__).with_name("questionnaires.toml"), "questionnaires")
SCALES: tuple[str, ...] = tuple(scale["name"] for scale in _WORDS["tlx"])
PAIRS = tuple(combinations(SCALES, 2))
STATEMENTS = tuple(f"q{number + 1}" for number in range(len(_WORDS["sus"]["statements"])))
_POINTS = 5  # of a statement


def scales_form() -> Form:
    """Return the six scales of NASA-TLX."""
    items = (
        Item(each["name"], "scale", each["text"], each["help"], each["low"], each["high"], step=5)
        for each in _WORDS["tlx"]
    )
    text = "Rate the tasks that you have just done. Choose one of the 21 places on each line."
    return Form(TLX, "How was it? (NASA-TLX)", text, tuple(items))


def pairs_form(rng: np.random.Generator) -> Form:
    """Return the 15 comparisons; their order, and which side a scale is on, are drawn."""
    titles = {scale["name"]: scale["title"] for scale in _WORDS["tlx"]}
    items = []
    for index in rng.permutation(len(PAIRS)):
        pair = PAIRS[index]
        sides = pair if rng.random() < 0.5 else pair[::-1]
        items.append(Item("_".join(pair), "pair", "", choices=tuple((name, titles[name]) for name in sides)))
    text = "Choose the one of each pair that contributed more to the workload of the tasks just done."
    return Form(TLX_PAIRS, "Which contributed more? (NASA-TLX)", text, tuple(items))


def sus_form() -> Form:
    """Return the ten statements of SUS."""
    ends = "strongly disagree", "strongly agree"
    items = (
        Item(name, "likert", text, "", *ends, least=1, most=_POINTS)
        for name, text in zip(STATEMENTS, _WORDS["sus"]["statements"], strict=True)
    )
    text = "How far do you agree? The system is the way of steering that you have just used."
    return Form(SUS, "How usable was it? (SUS)", text, tuple(items))


def tlx_raw(ratings: Mapping[str, Answer]) -> float | None:
    """Return the mean of the six scales, 0 to 100; None where one was not answered."""
    values = _known(ratings, SCALES)
    return sum(values) / len(values) if values else None


def tlx_weighted(ratings: Mapping[str, Answer], chosen: Mapping[str, Answer]) -> float | None:
    """Return `Σ scale × weight / 15`, 0 to 100, a weight being how often a scale was chosen.

    None where a scale or one of the 15 pairs was not answered.
    """
    values, winners = _known(ratings, SCALES), [chosen.get("_".join(pair)) for pair in PAIRS]
    if not values or None in winners:
        return None
    return sum(value * winners.count(name) for value, name in zip(values, SCALES, strict=True)) / len(PAIRS)


def sus_score(answers: Mapping[str, Answer]) -> float | None:
    """Return `2.5 (Σ odd (x − 1) + Σ even (5 − x))`, 0 to 100; None where one was not answered."""
    values = _known(answers, STATEMENTS)
    if not values:
        return None
    return 2.5 * (sum(x - 1 for x in values[::2]) + sum(_POINTS - x for x in values[1::2]))


def _known(answers: Mapping[str, Answer], names: tuple[str, ...]) -> list[float]:
    """Return the numbers that were answered; none at all if one is missing."""
    values = [answers.get(name) for name in names]
    known = [float(value) for value in values if isinstance(value, int | float)]
    return known if len(known) == len(names) else []
