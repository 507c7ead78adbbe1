"""The forms of a study: consent, NASA-TLX, SUS, and its own questions."""

from collections.abc import Callable, Mapping

import numpy as np

from handrail.collect.user_study.design import Question, UserStudy
from handrail.collect.user_study.items import Form, Item
from handrail.collect.user_study.usability import SUS, sus_form
from handrail.collect.user_study.workload import TLX, TLX_PAIRS, pairs_form, scales_form

CONSENT, START, END, QUESTIONS = "consent", "start", "end", "questions"
AGREED, REFUSED = "yes", "no"
_CONSENT = Item(
    "consent",
    "choice",
    "Do you take part?",
    choices=(AGREED, REFUSED),
    shown=("I have read this, and take part of my own free will.", "I do not take part."),
    declines=False,
)
_TITLES = {START: "Before we begin", QUESTIONS: "A few more questions", END: "At last"}
_WHEN = {START: "start", QUESTIONS: "condition", END: "end"}


def form_names(study: UserStudy) -> tuple[str, ...]:
    """Return the forms after each condition, page by page."""
    pages = {"tlx": (TLX, TLX_PAIRS), "tlx_raw": (TLX,), "sus": (SUS,), "questions": (QUESTIONS,)}
    return tuple(page for form in study.forms for page in pages[form])


def form(study: UserStudy, name: str, rng: np.random.Generator) -> Form:
    """Return a form.

    Args:
        study: whose it is.
        name: of the form.
        rng: draws the order of comparisons.
    """
    if name in _WHEN:
        asked = (question for question in study.questions if question.when == _WHEN[name])
        return Form(name, _TITLES[name], "", tuple(map(_item, asked)))
    known: Mapping[str, Callable[[], Form]] = {
        CONSENT: lambda: Form(CONSENT, study.title, study.consent, (_CONSENT,)),
        TLX: scales_form,
        TLX_PAIRS: lambda: pairs_form(rng),
        SUS: sus_form,
    }
    return known[name]()


def _item(question: Question) -> Item:
    likert = question.kind == "likert"
    return Item(
        question.name,
        question.kind,  # pyright: ignore[reportArgumentType]  (checked where it was read)
        question.text,
        low=question.low,
        high=question.high,
        least=1 if likert else question.least,
        most=question.points if likert else question.most,
        choices=question.choices,
    )
