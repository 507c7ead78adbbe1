"""NASA-TLX: the workload of a condition, as the person who did it rates and weighs it.

S. G. Hart, L. E. Staveland, Development of NASA-TLX (Task Load Index): results of empirical and theoretical
research, Advances in Psychology 52 (1988), 139-183. Scales and words are those of NASA's own form.
"""

from collections.abc import Mapping
from itertools import combinations

import numpy as np

from handrail.collect.user_study.items import Answer, Form, Item

_VERY = ("very low", "very high")
_SCALES: Mapping[str, tuple[str, str, str, tuple[str, str]]] = {
    "mental": (
        "Mental Demand",
        "How mentally demanding was the task?",
        "How much mental and perceptual activity was required (thinking, deciding, calculating, remembering, "
        "looking, searching)? Was the task easy or demanding, simple or complex, exacting or forgiving?",
        _VERY,
    ),
    "physical": (
        "Physical Demand",
        "How physically demanding was the task?",
        "How much physical activity was required (pushing, pulling, turning, controlling, activating)? Was "
        "the task easy or demanding, slow or brisk, slack or strenuous, restful or laborious?",
        _VERY,
    ),
    "temporal": (
        "Temporal Demand",
        "How hurried or rushed was the pace of the task?",
        "How much time pressure did you feel due to the rate or pace at which the tasks or task elements "
        "occurred? Was the pace slow and leisurely or rapid and frantic?",
        _VERY,
    ),
    "performance": (
        "Performance",
        "How successful were you in accomplishing what you were asked to do?",
        "How satisfied were you with your performance in accomplishing these goals? Mind the ends: perfect "
        "is on the left.",
        ("perfect", "failure"),
    ),
    "effort": (
        "Effort",
        "How hard did you have to work to accomplish your level of performance?",
        "Mentally and physically.",
        _VERY,
    ),
    "frustration": (
        "Frustration",
        "How insecure, discouraged, irritated, stressed, and annoyed were you?",
        "Versus secure, gratified, content, relaxed and complacent.",
        _VERY,
    ),
}
SCALES = tuple(_SCALES)
PAIRS = tuple(combinations(SCALES, 2))
TLX, TLX_PAIRS = "tlx", "tlx_pairs"


def scales_form() -> Form:
    """Return the six scales."""
    items = (
        Item(name, "scale", f"{title}: {question}", more, *ends)
        for name, (title, question, more, ends) in _SCALES.items()
    )
    text = "Rate the tasks that you have just done. Choose one of the 21 places on each line."
    return Form(TLX, "How was it? (NASA-TLX)", text, tuple(items))


def pairs_form(rng: np.random.Generator) -> Form:
    """Return the 15 comparisons; their order, and which side a scale is on, are drawn."""
    text = "Of each pair, choose what contributed more to the workload of the tasks that you have just done."
    items = []
    for index in rng.permutation(len(PAIRS)):
        pair = PAIRS[index]
        sides = pair if rng.random() < 0.5 else pair[::-1]
        titles = tuple(_SCALES[name][0] for name in sides)
        items.append(Item("_".join(pair), "pair", "", choices=sides, shown=titles))
    return Form(TLX_PAIRS, "What contributed more? (NASA-TLX)", text, tuple(items))


def tlx_raw(ratings: Mapping[str, Answer]) -> float | None:
    """Return the mean of the six scales, 0 to 100; None where one was not answered."""
    values = [ratings.get(name) for name in SCALES]
    known = [float(value) for value in values if isinstance(value, int | float)]
    return sum(known) / len(SCALES) if len(known) == len(SCALES) else None


def tlx_weighted(ratings: Mapping[str, Answer], chosen: Mapping[str, Answer]) -> float | None:
    """Return `Σ scale × weight / 15`, 0 to 100, a weight being how often a scale was chosen.

    Args:
        ratings: of the scales.
        chosen: of each of the 15 pairs; None where one was not answered, as of `ratings`, gives None.
    """
    winners = [chosen.get("_".join(pair)) for pair in PAIRS]
    if tlx_raw(ratings) is None or None in winners:
        return None
    return sum(float(ratings[name] or 0) * winners.count(name) for name in SCALES) / len(PAIRS)
