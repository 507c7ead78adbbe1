"""What a participant reads: forms, instructions, and a strip above the robot while they drive."""

from collections.abc import Mapping
from typing import Any

from handrail.collect.user_study.design import DEMO_NOTE, Practice, UserStudy
from handrail.collect.user_study.items import Answer, Form, Item
from handrail.collect.user_study.plan import Step

NEXT, PAUSE = ":next", ":pause"  # what the buttons answer; no question is called so
GO_ON, END = "on", "end"
_PAUSE = Item(
    "pause",
    "choice",
    "You have paused. The trial that you were in begins anew when you go on.",
    choices=(GO_ON, END),
    shown=("Go on now", "End for today; go on another time"),
    declines=False,
)


def form_card(
    study: UserStudy, key: str, form: Form, answers: Mapping[str, Answer], error: str = ""
) -> dict[str, Any]:
    """Return the card of a form.

    Args:
        study: whose it is.
        key: of the form, which is the card's id.
        form: what is asked.
        answers: that are on the disk.
        error: what is wrong with an answer.
    """
    return _card(study, key, form.title, form.text) | {
        "items": [item.described for item in form.items],
        "answers": dict(answers),
        "error": error,
        "pause": form.name != "consent",
    }


def instructions_card(
    study: UserStudy, step: Step, task: str, help_: str, channels: tuple[str, ...], place: str
) -> dict[str, Any]:
    """Return the card before a task in a mode.

    Args:
        study: whose it is.
        step: the first one of the task in the mode.
        task: what is to be done, in words.
        help_: what the mode is, in one line.
        channels: that the operator owns, for the keys.
        place: in the session, in words.
    """
    mode = study.instructions.get(step.condition, help_[:1].upper() + help_[1:] + ".")
    text = f"Your way of steering now: {step.condition}\n\n{mode}\n\nThe task: {task}\n\n{_counts(study)}"
    key = f"{step.condition}/{step.task}/instructions"
    return _card(study, key, place, text) | {"keys": list(channels), "pause": True}


def pause_card(study: UserStudy, number: int) -> dict[str, Any]:
    """Return the question whether to go on; the number tells pauses apart."""
    card = form_card(study, f"pause/{number}", Form("pause", "Paused", "", (_PAUSE,)), {})
    return card | {"pause": False}


def last_card(study: UserStudy, title: str, text: str) -> dict[str, Any]:
    """Return a card with nothing to answer."""
    return _card(study, f"last/{title}", title, text) | {"last": True}


def strip(study: UserStudy, words: str) -> dict[str, Any]:
    """Return what stands above the robot; it covers nothing."""
    return {"id": "", "strip": words, "note": _note(study)}


def practice_words(practice: Practice, successes: list[bool]) -> str:
    """Return how practice stands."""
    row = 0
    while row < len(successes) and successes[-1 - row]:
        row += 1
    return (
        f"Practice {len(successes) + 1} of at most {practice.most}, nothing is saved: "
        f"{row} of {practice.successes} successes in a row"
    )


def _counts(study: UserStudy) -> str:
    practice = f"Practice first: at most {study.practice.most}. " if study.practice.most else ""
    return f"{practice}Trials that count: {study.trials}. Failed gives a trial up; Pause lets you rest."


def _card(study: UserStudy, key: str, title: str, text: str) -> dict[str, Any]:
    paragraphs = [" ".join(part.split()) for part in text.split("\n\n") if part.strip()]
    return {
        "id": key,
        "title": title,
        "text": paragraphs,
        "items": [],
        "answers": {},
        "error": "",
        "keys": [],
        "pause": False,
        "last": False,
        "note": _note(study),
    }


def _note(study: UserStudy) -> str:
    return DEMO_NOTE if study.demo else ""
