"""The forms of a study: consent, NASA-TLX, SUS, and its own questions."""

import numpy as np

from handrail.collect.user_study.design import Question, UserStudy
from handrail.collect.user_study.items import Form, Item
from handrail.collect.user_study.questionnaires import SUS, TLX, TLX_PAIRS, pairs_form, scales_form, sus_form

CONSENT, START, END, QUESTIONS = "consent", "start", "end", "questions"
AGREED, REFUSED = "yes", "no"
_CONSENT = Item(
    "consent",
    "choice",
    "Do you take part?",
    choices=(
        (AGREED, "I have read this, and take part of my own free will."),
        (REFUSED, "I do not take part."),
    ),
    declines=False,
)
_OWN = {
    START: ("start", "Before we begin"),
    QUESTIONS: ("condition", "A few more questions"),
    END: ("end", "At last"),
}


def form_names(study: UserStudy) -> tuple[str, ...]:
    """Return the forms after each condition, page by page."""
    pages = {"tlx": (TLX, TLX_PAIRS), "tlx_raw": (TLX,), "sus": (SUS,), "questions": (QUESTIONS,)}
    return tuple(page for form in study.forms for page in pages[form])


def form(study: UserStudy, name: str, rng: np.random.Generator) -> Form:
    """Return the form of a name; `rng` draws the order of comparisons."""
    if name in _OWN:
        when, title = _OWN[name]
        asked = (question for question in study.questions if question.when == when)
        return Form(name, title, items=tuple(map(_item, asked)))
    if name == CONSENT:
        return Form(CONSENT, study.title, study.consent, (_CONSENT,))
    return pairs_form(rng) if name == TLX_PAIRS else {TLX: scales_form, SUS: sus_form}[name]()


def _item(question: Question) -> Item:
    ends = question.low, question.high, *question.bounds
    choices = tuple((choice, choice) for choice in question.choices)
    return Item(question.name, question.kind, question.text, "", *ends, choices=choices)
