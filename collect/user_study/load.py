"""Reading a user study from its TOML file, or from the JSON in which it is frozen, and checking it whole."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from handrail.collect.operators.modes import MODES
from handrail.collect.user_study.design import ALLOWED, FORMS, KINDS, WHEN, Practice, Question, UserStudy
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.entries import (
    Entry,
    check_entries,
    is_count,
    is_name,
    is_number,
    is_table,
    is_text,
    lists,
)
from handrail.controllers.errors import HandrailError, shown, unknown_name
from handrail.controllers.fields import check_fields
from handrail.controllers.robot.catalogue import ROBOTS

_MOST_TRIALS, _MOST_POINTS, _LONGEST_PAGE = 100, 21, 20_000


def _is_page(value: Any) -> bool:
    """Return whether a value is a text in some lines."""
    fine = isinstance(value, str) and bool(value.strip()) and len(value) <= _LONGEST_PAGE
    return fine and all(line.isprintable() for line in value.split("\n"))


def _whole(least: int, most: int) -> Callable[[Any], bool]:
    return lambda value: is_count(value) and least <= value <= most


_STUDY: Mapping[str, Entry] = {  # what the types of the fields do not say
    "title": Entry("a text in one line", is_text),
    "consent": Entry(f"a text of at most {_LONGEST_PAGE} characters", _is_page),
    "modes": Entry("a list of modes", lists(is_name)),
    "tasks": Entry("a list of tasks", lists(is_name)),
    "trials": Entry(f"1 to {_MOST_TRIALS}", _whole(1, _MOST_TRIALS), needed=False),
    "questions": Entry(
        "tables [[questions]]", lambda value: value == [] or lists(is_table)(value), needed=False
    ),
    "instructions": Entry(
        "texts by mode", lambda value: is_table(value) and all(map(_is_page, value.values())), needed=False
    ),
    "thanks": Entry("a text", _is_page, needed=False),
}
_PRACTICE: Mapping[str, Entry] = {
    "successes": Entry(f"1 to {_MOST_TRIALS}", _whole(1, _MOST_TRIALS), needed=False),
    "most": Entry(f"0 (none) to {_MOST_TRIALS}", _whole(0, _MOST_TRIALS), needed=False),
}
_QUESTION: Mapping[str, Entry] = {
    "name": Entry("a name of letters, digits and _", lambda value: is_name(value) and value.isidentifier()),
    "text": Entry("a text in one line", is_text),
    "kind": Entry("a kind of answer", is_name),
    "when": Entry("a moment", is_name, needed=False),
}
_OF_KIND: Mapping[str, Mapping[str, Entry]] = {
    "likert": {
        "points": Entry(f"2 to {_MOST_POINTS}", _whole(2, _MOST_POINTS), needed=False),
        "low": Entry("a text in one line", is_text, needed=False),
        "high": Entry("a text in one line", is_text, needed=False),
    },
    "number": {
        "least": Entry("a number", is_number, needed=False),
        "most": Entry("a number", is_number, needed=False),
    },
    "choice": {"choices": Entry("a list of two texts or more", lists(is_text))},
    "text": {},
}


def parse_study(content: Any, where: str) -> UserStudy:
    """Return the study that a table says.

    Args:
        content: the table.
        where: it is, for the error.
    """
    check_fields(content, UserStudy, where, **_STUDY)
    practice = content.get("practice", {})
    check_entries(practice, _PRACTICE, f"{where}: [practice]")
    questions = tuple(_question(each, where) for each in content.get("questions", []))
    plain: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in content.items()
    }
    study = UserStudy(**plain | {"practice": Practice(**practice), "questions": questions})
    _check(study, where)
    return study


def _question(content: Any, where: str) -> Question:
    name = content.get("name") if is_table(content) else None
    where = f"{where}: question {shown(name)}"
    kind = content.get("kind")
    if kind not in KINDS:
        raise unknown_name(f"kind of {where}", kind, KINDS)
    check_entries(content, {**_QUESTION, **_OF_KIND[kind]}, where)
    question = Question(**content | {"choices": tuple(content.get("choices", ()))})
    if question.when not in WHEN:
        raise unknown_name(f"when of {where}", question.when, WHEN)
    if not question.least < question.most:
        raise HandrailError(f"{where}: expected least < most, got {question.least} and {question.most}")
    if kind == "choice" and (len(question.choices) < 2 or len(set(question.choices)) < len(question.choices)):
        raise HandrailError(f"{where}: choices: expected two or more, each once, got {question.choices}")
    return question


def _check(study: UserStudy, where: str) -> None:
    chosen = {"mode": study.modes, "task": study.tasks, "form": study.forms, "allow": study.allow}
    chosen |= {"question": tuple(question.name for question in study.questions), "camera": study.cameras}
    for thing, names in chosen.items():
        if len(set(names)) < len(names):
            raise HandrailError(f"{where}: {thing}: expected each once, got {', '.join(names)}")
    chosen |= {"robot": (study.robot,)}
    known = {"mode": MODES, "task": TASKS, "form": FORMS, "allow": ALLOWED, "robot": ROBOTS}
    for thing, choices in known.items():
        for name in chosen[thing]:
            if name not in choices:
                raise unknown_name(f"{thing} of {where}", name, choices)
    for mode in study.instructions:
        if mode not in study.modes:
            raise unknown_name(f"mode in [instructions] of {where}", mode, study.modes)
    if {"tlx", "tlx_raw"} <= set(study.forms):
        raise HandrailError(f"{where}: forms: expected tlx or tlx_raw (which has no comparisons), got both")
    asked = any(question.when == "condition" for question in study.questions)
    if asked != ("questions" in study.forms):
        raise HandrailError(
            f"{where}: forms: expected 'questions' among them exactly if a [[questions]] is asked after each"
            f" condition, got {', '.join(study.forms) or 'none'}"
        )
    for mode in study.modes:
        for task in study.tasks:
            try:
                study.recording(mode, task, Path("data")).check()
            except HandrailError as error:
                raise HandrailError(f"{where}: {error}") from error
