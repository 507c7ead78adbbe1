"""The steps of a participant's session.

```
consent ─ questions at the start ─▶ for each mode, in the participant's order:
                                      for each task: practice to criterion ─ trials
                                      forms
                                  ─▶ questions at the end
```
Tasks are blocks within a mode: a form is about the mode, and nobody learns a mode anew for every task. Both
orders are rows of Williams designs.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from handrail.collect.seeds import mixed_seed
from handrail.collect.user_study.design import UserStudy
from handrail.collect.user_study.forms import CONSENT, END, START, form_names

_ORDER, _TRIAL, _PRACTICE, _PAIRS = range(4)  # purposes of a seed


def williams(n: int) -> list[tuple[int, ...]]:
    """Return the sequences of a Williams design of n conditions: n for an even n, 2n for an odd one.

    The first sequence is `0, 1, n − 1, 2, n − 2, …`; each other one adds a constant modulo n. For an odd n
    the reversed sequences follow.
    """
    first = [0]
    for step in range(1, n):
        first.append((first[-1] + (step if step % 2 else -step)) % n)
    sequences = [tuple((each + shift) % n for each in first) for shift in range(n)]
    return sequences + [sequence[::-1] for sequence in sequences] if n % 2 and n > 1 else sequences


def order(names: tuple[str, ...], row: int, rng: np.random.Generator) -> tuple[str, ...]:
    """Return the order of a row of the design; after the last sequence the first one follows.

    `rng`, the same for all rows, draws the numbers of the names and the order of the sequences, those of one
    Latin square before those of the other.
    """
    sequences, size = williams(len(names)), len(names)
    labels = rng.permutation(size)
    places = np.concatenate([start + rng.permutation(size) for start in range(0, len(sequences), size)])
    return tuple(names[labels[each]] for each in sequences[places[row % len(sequences)]])


def orders(study: UserStudy, slot: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the orders of modes and of tasks in a row of the design; every pair of rows is equally often."""
    modes, tasks = len(williams(len(study.modes))), len(williams(len(study.tasks)))
    row = slot + slot // math.lcm(modes, tasks) % math.gcd(modes, tasks)
    rng = np.random.default_rng([study.seed, _ORDER])
    return order(study.modes, slot, rng), order(study.tasks, row, rng)


@dataclass(frozen=True)
class Step:
    """A form, the practice of a task in a mode, or a trial."""

    kind: Literal["form", "practice", "trial"]
    condition: str = ""  # the mode; empty before and after all conditions
    task: str = ""
    trial: int = 0  # its number, from 1
    form: str = ""

    @property
    def key(self) -> str:
        """A name that no other step of a participant has."""
        if self.kind == "form":
            return f"{self.condition}/{self.form}" if self.condition else self.form
        return f"{self.condition}/{self.task}/{self.trial or 'practice'}"

    def __str__(self) -> str:
        if self.kind == "form":
            return f"{self.condition}, form {self.form}" if self.condition else f"form {self.form}"
        what = f"trial {self.trial}" if self.trial else "practice"
        return f"{self.condition}, {self.task}, {what}"


def plan(study: UserStudy, modes: tuple[str, ...], tasks: tuple[str, ...]) -> Iterator[Step]:
    """Yield all steps of a participant, whose orders of modes and tasks `orders` drew once."""
    asked = {question.when for question in study.questions}
    yield Step("form", form=CONSENT)
    if "start" in asked:
        yield Step("form", form=START)
    for mode in modes:
        for task in tasks:
            if study.practice.most:
                yield Step("practice", mode, task)
            yield from (Step("trial", mode, task, number + 1) for number in range(study.trials))
        yield from (Step("form", mode, form=name) for name in form_names(study))
    if "end" in asked:
        yield Step("form", form=END)


def trial_seed(study: UserStudy, task: str, trial: int) -> int:
    """Return the seed of a trial: the same scene in every mode and for every participant."""
    return mixed_seed(study.seed, _TRIAL, study.tasks.index(task), trial)


def practice_seed(study: UserStudy, mode: str, task: str, attempt: int) -> int:
    """Return the seed of a trial of practice: a scene that no trial has."""
    return mixed_seed(study.seed, _PRACTICE, study.tasks.index(task), study.modes.index(mode), attempt)


def pairs_rng(study: UserStudy, slot: int, condition: str) -> np.random.Generator:
    """Return what draws the order of a participant's comparisons after a condition: the same every time."""
    place = study.modes.index(condition) if condition else len(study.modes)
    return np.random.default_rng([study.seed, _PAIRS, slot, place])
