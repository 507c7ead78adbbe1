"""SUS: the System Usability Scale.

J. Brooke, SUS: a "quick and dirty" usability scale, Usability Evaluation in Industry (1996), 189-194.
"""

from collections.abc import Mapping

from handrail.collect.user_study.items import Answer, Form, Item

SUS = "sus"
_POINTS = 5
_ITEMS = (
    "I think that I would like to use this system frequently.",
    "I found the system unnecessarily complex.",
    "I thought the system was easy to use.",
    "I think that I would need the support of a technical person to be able to use this system.",
    "I found the various functions in this system were well integrated.",
    "I thought there was too much inconsistency in this system.",
    "I would imagine that most people would learn to use this system very quickly.",
    "I found the system very cumbersome to use.",
    "I felt very confident using the system.",
    "I needed to learn a lot of things before I could get going with this system.",
)
NAMES = tuple(f"q{number}" for number in range(1, len(_ITEMS) + 1))


def sus_form() -> Form:
    """Return the ten statements."""
    ends = "strongly disagree", "strongly agree"
    items = (
        Item(name, "likert", text, "", *ends, least=1, most=_POINTS)
        for name, text in zip(NAMES, _ITEMS, strict=True)
    )
    text = "How far do you agree? The system is the way of steering that you have just used."
    return Form(SUS, "How usable was it? (SUS)", text, tuple(items))


def sus_score(answers: Mapping[str, Answer]) -> float | None:
    """Return `2.5 (Σ odd (x − 1) + Σ even (5 − x))`, 0 to 100; None where one was not answered."""
    values = [answers.get(name) for name in NAMES]
    known = [value for value in values if isinstance(value, int)]
    if len(known) < len(NAMES):
        return None
    return 2.5 * (sum(x - 1 for x in known[::2]) + sum(_POINTS - x for x in known[1::2]))
