"""What is asked on a form, item by item, and which answers it takes."""

import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from handrail.controllers.entries import is_number
from handrail.controllers.errors import HandrailError, shown

Kind = Literal["scale", "likert", "number", "choice", "pair", "text"]
Answer = str | float | int | None
LONGEST_TEXT = 1500  # characters
_STEP = 5  # of a scale from 0 to 100: 21 places


@dataclass(frozen=True)
class Item:
    """A question. The answer None is "prefer not to answer", and fits wherever that may be said.

    Attributes:
        name: in the tables.
        kind: how it is answered: a `scale` of 21 steps from 0 to 100, a `likert` scale from 1, a `number`, a
            `choice` of texts, a `pair` of which one is chosen, a `text`.
        text: the question.
        help: more of it.
        low: what the lower end of a scale says.
        high: what the upper end says.
        least: smallest number.
        most: largest number; of a likert scale, its points.
        choices: of a choice or a pair.
        shown: what the choices say, where that is not themselves.
        declines: whether one may prefer not to answer.
    """

    name: str
    kind: Kind
    text: str
    help: str = ""
    low: str = ""
    high: str = ""
    least: float = 0.0
    most: float = 100.0
    choices: tuple[str, ...] = ()
    shown: tuple[str, ...] = ()
    declines: bool = True

    def check(self, value: Any) -> Answer:
        """Return an answer, if it is one."""
        if (value is None and self.declines) or self._fits(value):
            return value
        raise HandrailError(f"answer to {self.name}: expected {self._expected}, got {shown(value)}")

    def _fits(self, value: Any) -> bool:
        if self.kind in ("choice", "pair"):
            return value in self.choices
        if self.kind == "text":
            return isinstance(value, str) and bool(value.strip()) and _is_clean(value)
        if not is_number(value) or not self.least <= value <= self.most:
            return False
        return self.kind == "number" or (type(value) is int and not (value - int(self.least)) % self._step)

    @property
    def _step(self) -> int:
        return _STEP if self.kind == "scale" else 1

    @property
    def _expected(self) -> str:
        if self.kind in ("choice", "pair"):
            return f"one of {', '.join(self.choices)}"
        if self.kind == "text":
            return f"a text of at most {LONGEST_TEXT} characters"
        step = "" if self.kind == "number" else f" by {self._step}"
        return f"{self.least:g} to {self.most:g}{step}"

    @property
    def described(self) -> dict[str, Any]:
        """What the page needs to draw it."""
        shown = self.shown or self.choices
        return {
            "name": self.name,
            "kind": self.kind,
            "text": self.text,
            "help": self.help,
            "low": self.low,
            "high": self.high,
            "least": self.least,
            "most": self.most,
            "step": self._step,
            "choices": [list(each) for each in zip(self.choices, shown, strict=True)],
            "declines": self.declines,
            "longest": LONGEST_TEXT,
        }


@dataclass(frozen=True)
class Form:
    """A page of questions.

    Attributes:
        name: in the tables.
        title: of the page.
        text: before the questions.
        items: the questions.
    """

    name: str
    title: str
    text: str
    items: tuple[Item, ...]

    def item(self, name: str) -> Item:
        """Return the question of a name."""
        for item in self.items:
            if item.name == name:
                return item
        raise HandrailError(f"form {self.name}: unknown item {shown(name)}")

    def missing(self, answers: Mapping[str, Answer]) -> list[str]:
        """Return the names of what has not been answered, nor declined."""
        return [item.name for item in self.items if item.name not in answers]


def _is_clean(text: str) -> bool:
    """Return whether a text is not too long and can be written to any file."""
    kinds = {unicodedata.category(letter) for letter in text if letter != "\n"}
    return len(text) <= LONGEST_TEXT and not kinds & {"Cc", "Cs"}
