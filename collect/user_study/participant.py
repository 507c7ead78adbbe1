"""A participant's two files: each change is on the disk before anybody is told.

`session.json` holds their order and their practice, `answers.json` their answers. The datasets say which
trials are done.
"""

import datetime
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

from msgspec import Meta

from handrail.collect.user_study.items import Answer
from handrail.controllers.errors import HandrailError, shown
from handrail.controllers.typed import Count, Name, Text, decoded
from handrail.datasets.storage.atomic import explained
from handrail.datasets.storage.strict_json import load_json, write_json

_ID = re.compile(r"[A-Z]\d{2,6}")
_Names = Annotated[tuple[Name, ...], Meta(min_length=1)]


def now() -> str:
    """Return the time as text."""
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")


@dataclass(frozen=True)
class Practised:
    """A trial of practice."""

    condition: str
    task: str
    seed: Count
    success: bool
    seconds: float
    at: str = field(default_factory=now)


@dataclass(frozen=True)
class Interrupted:
    """A trial that was begun and not finished."""

    condition: str
    task: str
    trial: Count
    why: str
    at: str = field(default_factory=now)


@dataclass(frozen=True)
class Noted:
    """Something that happened: begun, paused, done."""

    what: str
    at: str = field(default_factory=now)


@dataclass(frozen=True)
class SessionRecord:
    """Content of `session.json`."""

    participant: str
    source: Text  # people, or demo data
    slot: Count  # the row of the design
    modes: _Names  # the conditions, in their order
    tasks: _Names
    practice: tuple[Practised, ...]
    interrupted: tuple[Interrupted, ...]
    events: tuple[Noted, ...]
    erasing: bool  # an erasure has begun


@dataclass(frozen=True)
class FilledForm:
    """The answers on a form so far, and when it was done; empty before."""

    items: Mapping[str, Answer] = field(default_factory=dict)
    done: str = ""


@dataclass(frozen=True)
class AnswersRecord:
    """Content of `answers.json`."""

    participant: str
    source: Text
    forms: Mapping[str, FilledForm]  # by key


def check_id(name: str) -> None:
    """Check a participant's id."""
    if not _ID.fullmatch(name):
        raise HandrailError(
            f"participant {shown(name)}: expected an id that says nothing of the person, a capital letter and"
            " 2 to 6 digits, such as P001"
        )


class Participant:
    """A participant's files, in a folder called after the id."""

    def __init__(self, folder: Path, newcomer: SessionRecord | None = None) -> None:
        self.name, self._folder = folder.name, folder
        if newcomer:
            _write(folder / "session.json", newcomer)
        self.session = _read(folder / "session.json", SessionRecord)
        self._answers = AnswersRecord(self.name, self.session.source, {})
        if (folder / "answers.json").exists():
            self._answers = _read(folder / "answers.json", AnswersRecord)

    @property
    def forms(self) -> Mapping[str, FilledForm]:
        """The answers by form's key."""
        return self._answers.forms

    @property
    def finished(self) -> set[str]:
        """The keys of the forms that are done."""
        return {key for key, form in self.forms.items() if form.done}

    def answers(self, key: str) -> dict[str, Answer]:
        """Return what they have answered on a form so far."""
        return dict(self.forms[key].items) if key in self.forms else {}

    def answer(self, key: str, item: str, value: Answer) -> None:
        """Keep an answer that fits its item."""
        self._keep_form(key, FilledForm({**self.answers(key), item: value}))

    def finish(self, key: str) -> None:
        """Keep that a form is done."""
        self._keep_form(key, FilledForm(self.answers(key), now()))

    def practised(self, mode: str, task: str) -> list[bool]:
        """Return whether the trials of practice of a task in a mode succeeded, in their order."""
        trials = self.session.practice
        return [each.success for each in trials if (each.condition, each.task) == (mode, task)]

    def add(self, **entries: Practised | Interrupted | Noted) -> None:
        """Keep one more entry of the session's `practice`, `interrupted` or `events`."""
        self.keep(**{name: (*getattr(self.session, name), entry) for name, entry in entries.items()})

    def keep(self, **changes: Any) -> None:
        """Keep changes of the session."""
        changed = replace(self.session, **changes)
        _write(self._folder / "session.json", changed)
        self.session = changed

    def _keep_form(self, key: str, form: FilledForm) -> None:
        changed = replace(self._answers, forms={**self.forms, key: form})
        _write(self._folder / "answers.json", changed)
        self._answers = changed


def _read[T: (SessionRecord, AnswersRecord)](path: Path, kind: type[T]) -> T:
    record = decoded(load_json(path, "a file of a participant of a user study"), kind, str(path))
    if record.participant != path.parent.name:
        raise HandrailError(
            f"{path}: expected participant {path.parent.name}, got {shown(record.participant)}"
        )
    return record


def _write(path: Path, record: SessionRecord | AnswersRecord) -> None:
    with explained(f"cannot write {str(path)!r}"):
        write_json(path, asdict(record))
