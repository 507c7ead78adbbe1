"""What is known of a participant: two files, each change on the disk before anybody is told.

`session.json` says in which order they take part and what came of practice, `answers.json` what they said.
Which trials are done is not here: the datasets say so.
"""

import datetime
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from handrail.collect.session.outcome import Outcome
from handrail.collect.user_study.items import Answer
from handrail.collect.user_study.plan import Step
from handrail.controllers.entries import Entry, check_entries, is_count, is_name, is_table, is_text, lists
from handrail.controllers.errors import HandrailError, shown
from handrail.datasets.storage.atomic import explained
from handrail.datasets.storage.strict_json import load_json, write_json

_ID = re.compile(r"[A-Z]\d{2,6}")
_LIST = Entry("a list", lambda value: isinstance(value, list))
_SESSION: Mapping[str, Entry] = {
    "participant": Entry("an id", is_name),
    "source": Entry("a text", is_text),
    "slot": Entry("a whole number", is_count),
    "modes": Entry("a list of modes", lists(is_name)),
    "tasks": Entry("a list of tasks", lists(is_name)),
    "practice": _LIST,
    "interrupted": _LIST,
    "events": _LIST,
    "erasing": Entry("true or false", lambda value: isinstance(value, bool)),
}
_ANSWERS: Mapping[str, Entry] = {
    "participant": Entry("an id", is_name),
    "source": Entry("a text", is_text),
    "forms": Entry("a table", lambda value: is_table(value) and all(map(is_table, value.values()))),
}


def check_id(name: str) -> None:
    """Check a participant's id."""
    if not _ID.fullmatch(name):
        raise HandrailError(
            f"participant {shown(name)}: expected an id that says nothing of the person, a capital letter and"
            " 2 to 6 digits, such as P001"
        )


class Participant:
    """A participant's files.

    Args:
        folder: of the files; called after the id.
    """

    def __init__(self, folder: Path) -> None:
        self._session_file, self._answers_file = folder / "session.json", folder / "answers.json"
        self.name = folder.name
        self._session = _read(self._session_file, _SESSION, "the session of a participant")
        self._answers = {"participant": self.name, "source": self._session["source"], "forms": {}}
        if self._answers_file.exists():
            self._answers = _read(self._answers_file, _ANSWERS, "the answers of a participant")

    @classmethod
    def create(
        cls, folder: Path, source: str, slot: int, modes: tuple[str, ...], tasks: tuple[str, ...]
    ) -> "Participant":
        """Begin the files of a newcomer."""
        content = {"participant": folder.name, "source": source, "slot": slot, "modes": modes, "tasks": tasks}
        content |= {"practice": [], "interrupted": [], "events": [], "erasing": False}
        _write(folder / "session.json", content)
        return cls(folder)

    @property
    def slot(self) -> int:
        """Which row of the design they have, from 0."""
        return self._session["slot"]

    @property
    def source(self) -> str:
        """People, or demo data."""
        return self._session["source"]

    @property
    def modes(self) -> tuple[str, ...]:
        """The conditions, in their order."""
        return tuple(self._session["modes"])

    @property
    def practice(self) -> tuple[Mapping[str, Any], ...]:
        """What they practised: condition, task, seed, success, seconds, at."""
        return tuple(self._session["practice"])

    @property
    def interrupted(self) -> tuple[Mapping[str, Any], ...]:
        """Trials that were begun and not finished: condition, task, trial, why, at."""
        return tuple(self._session["interrupted"])

    @property
    def erasing(self) -> bool:
        """Whether an erasure has begun."""
        return self._session["erasing"]

    @property
    def forms(self) -> Mapping[str, Mapping[str, Any]]:
        """The answers by form's key: `items` by name, and when the form was `done`, empty before."""
        return self._answers["forms"]

    def answers(self, key: str) -> dict[str, Answer]:
        """Return what they have answered on a form so far."""
        return dict(self.forms.get(key, {}).get("items", {}))

    def answer(self, key: str, item: str, value: Answer) -> None:
        """Keep an answer that fits its item."""
        self._keep_form(key, {"items": {**self.answers(key), item: value}, "done": ""})

    def finish(self, key: str) -> None:
        """Keep that a form is done."""
        self._keep_form(key, {"items": self.answers(key), "done": now()})

    def finished(self) -> set[str]:
        """Return the keys of the forms that are done."""
        return {key for key, form in self.forms.items() if form.get("done")}

    def practised(self, step: Step, outcome: Outcome) -> None:
        """Keep what came of a trial of practice."""
        done = {"condition": step.condition, "task": step.task, "seed": outcome.seed}
        done |= {"success": outcome.success, "seconds": round(outcome.seconds, 3), "at": now()}
        self._keep(practice=[*self.practice, done])

    def practised_so_far(self, mode: str, task: str) -> list[bool]:
        """Return whether the trials of practice of a task in a mode succeeded, in their order."""
        place = (mode, task)
        return [bool(each["success"]) for each in self.practice if (each["condition"], each["task"]) == place]

    def interrupt(self, step: Step, why: str) -> None:
        """Keep that a trial was begun and not finished."""
        said = {"condition": step.condition, "task": step.task, "trial": step.trial, "why": why, "at": now()}
        self._keep(interrupted=[*self.interrupted, said])

    def note(self, what: str) -> None:
        """Keep that something happened: begun, paused, done."""
        self._keep(events=[*self._session["events"], {"at": now(), "what": what}])

    def begin_erasing(self) -> None:
        """Keep that they are to be erased: nothing is added from now on."""
        self._keep(erasing=True)

    def _keep(self, **changes: Any) -> None:
        changed = {**self._session, **changes}
        _write(self._session_file, changed)
        self._session = changed

    def _keep_form(self, key: str, form: Mapping[str, Any]) -> None:
        changed = {**self._answers, "forms": {**self.forms, key: form}}
        _write(self._answers_file, changed)
        self._answers = changed


def now() -> str:
    """Return the time as text."""
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")


def _read(path: Path, entries: Mapping[str, Entry], what: str) -> dict[str, Any]:
    content = load_json(path, what)
    check_entries(content, entries, str(path))
    if content["participant"] != path.parent.name:
        raise HandrailError(
            f"{path}: expected participant {path.parent.name}, got {shown(content['participant'])}"
        )
    return content


def _write(path: Path, content: Mapping[str, Any]) -> None:
    with explained(f"cannot write {str(path)!r}"):
        write_json(path, content)
