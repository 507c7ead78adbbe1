"""Questions of a form, and which answers they take."""

import unicodedata
from dataclasses import dataclass
from typing import Any

from handrail.controllers.errors import HandrailError, shown

Answer = str | float | int | None
"""An answer; None is "prefer not to answer"."""
LONGEST_TEXT = 1500  # characters


@dataclass(frozen=True)
class Item:
    """A question, as the page draws it."""

    name: str  # in the tables
    kind: str  # scale, likert, number, choice, pair (one of two is chosen) or text
    text: str
    help: str = ""  # more of the question
    low: str = ""  # label of the lower end of a scale
    high: str = ""
    least: float = 0.0
    most: float = 100.0
    step: int = 1  # between two places of a scale
    choices: tuple[tuple[str, str], ...] = ()  # answers, and how each is shown
    declines: bool = True  # whether one may prefer not to answer
    longest: int = LONGEST_TEXT  # of a text

    def check(self, value: Any) -> Answer:
        """Return an answer, if it is one."""
        if (value is None and self.declines) or self._fits(value):
            return value
        raise HandrailError(f"answer to {self.name}: expected {self._expected}, got {shown(value)}")

    def _fits(self, value: Any) -> bool:
        if self.choices:
            return any(value == choice for choice, _ in self.choices)
        if self.kind == "text":
            return isinstance(value, str) and bool(value.strip()) and self._is_clean(value)
        if type(value) not in (int, float) or not self.least <= value <= self.most:
            return False
        return self.kind == "number" or (type(value) is int and (value - int(self.least)) % self.step == 0)

    def _is_clean(self, text: str) -> bool:
        """Return whether a text is not too long and can be written to any file."""
        kinds = {unicodedata.category(letter) for letter in text if letter != "\n"}
        return len(text) <= self.longest and not kinds & {"Cc", "Cs"}

    @property
    def _expected(self) -> str:
        if self.choices:
            return f"one of {', '.join(choice for choice, _ in self.choices)}"
        if self.kind == "text":
            return f"a text of at most {self.longest} characters"
        step = "" if self.kind == "number" else f" by {self.step}"
        return f"{self.least:g} to {self.most:g}{step}"


@dataclass(frozen=True)
class Form:
    """A page of questions, or one to read."""

    name: str  # in the tables
    title: str
    text: str = ""
    items: tuple[Item, ...] = ()

    def check(self, name: str, value: Any) -> Answer:
        """Return an answer to the question of a name, if it is one."""
        for item in self.items:
            if item.name == name:
                return item.check(value)
        raise HandrailError(f"form {self.name}: unknown item {shown(name)}")
