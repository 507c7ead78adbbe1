"""A user study, as its file says it; light to import. `example.toml` explains every entry."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from msgspec import Meta

from handrail.collect.config import DatasetConfig, RecordConfig
from handrail.collect.operators.modes import MODES
from handrail.collect.world.tasks.catalogue import TASKS, check_robot
from handrail.controllers.errors import HandrailError, check_known, shown
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.robot.description import load_description
from handrail.controllers.typed import Count, Name, Number, Text
from handrail.datasets.comparison.scores import DEMO, PEOPLE

FORMS = ("tlx", "tlx_raw", "sus", "questions")
ALLOWED = ("mode", "mask", "undo", "discard", "restart", "success")
_OF_KIND = {
    "likert": ("points", "low", "high"),
    "number": ("least", "most"),
    "choice": ("choices",),
    "text": (),
}

Page = Annotated[str, Meta(max_length=20_000)]
"""A text in some lines."""
Trials = Annotated[int, Meta(ge=1, le=100)]


@dataclass(frozen=True)
class Practice:
    """How long is practised before the trials of a task in a mode."""

    successes: Trials = 2  # in a row, after which the trials begin
    most: Annotated[int, Meta(ge=0, le=100)] = 6  # after which they begin anyway; 0 for no practice

    def is_over(self, successes: Sequence[bool]) -> bool:
        """Return whether the criterion is met, or was tried for long enough."""
        last = successes[-self.successes :]
        return len(successes) >= self.most or (len(last) == self.successes and all(last))


@dataclass(frozen=True)
class Question:
    """A question of one's own; most entries belong to one kind of question only."""

    name: Name  # in the tables
    text: Text
    kind: Literal["likert", "number", "choice", "text"]
    when: Literal["condition", "start", "end"] = "condition"  # after each condition by default
    points: Annotated[int, Meta(ge=2, le=21)] | None = None  # of a likert scale, from 1; 7 by default
    low: Text = ""  # label of the first point
    high: Text = ""  # label of the last point
    least: Number | None = None  # 0 by default
    most: Number | None = None  # 100 by default
    choices: tuple[Text, ...] = ()

    def __post_init__(self) -> None:
        """Check what the types do not."""
        if not self.name.isidentifier():
            raise HandrailError(f"name: expected letters, digits and _, got {shown(self.name)}")
        for kind, names in _OF_KIND.items():
            for name in names:
                if kind != self.kind and getattr(self, name) not in (None, "", ()):
                    raise HandrailError(f"question {self.name}: {name}: expected only of kind {kind}, got it")
        least, most = self.bounds
        if not least < most:
            raise HandrailError(f"question {self.name}: expected least < most, got {least} and {most}")
        if self.kind == "choice" and (len(self.choices) < 2 or len(set(self.choices)) < len(self.choices)):
            raise HandrailError(
                f"question {self.name}: choices: expected two or more, each once, got {shown(self.choices)}"
            )

    @property
    def bounds(self) -> tuple[float, float]:
        """The smallest and the largest number of an answer."""
        if self.kind == "likert":
            return 1, self.points or 7
        return self.least or 0.0, 100.0 if self.most is None else self.most


@dataclass(frozen=True)
class UserStudy:
    """A whole user study; a mode is a condition of it."""

    title: Text
    consent: Page
    modes: tuple[str, ...]
    tasks: tuple[str, ...]  # done in each mode
    trials: Trials = 3  # of each task in each mode, recorded
    practice: Practice = field(default_factory=Practice)
    forms: tuple[str, ...] = ("tlx", "sus")  # after each condition
    questions: tuple[Question, ...] = ()
    instructions: Mapping[str, Page] = field(default_factory=dict)  # for a mode, instead of its line of help
    allow: tuple[str, ...] = ()  # what a participant may do beside driving
    thanks: Page = "Thank you for taking part."
    robot: str = "ridgeback_ur10"
    fps: int = 20  # of the recording [Hz]
    cameras: tuple[str, ...] = ()
    image_size: int | str = 128  # [pixels], or WIDTHxHEIGHT
    time_limit: float | int = 0.0  # of a trial [s]; the task's own when 0
    seed: Count = 0  # of scenes and orders
    demo: bool = False  # participants are synthetic, which every table says then

    def __post_init__(self) -> None:
        """Check what the types do not."""
        pages = {"consent": self.consent, "thanks": self.thanks, **self.instructions}
        for name, page in pages.items():
            if not page.strip() or not all(line.isprintable() for line in page.split("\n")):
                raise HandrailError(f"{name}: expected a text that can be printed, got {shown(page)}")
        asked = tuple(question.name for question in self.questions)
        chosen: Mapping[str, tuple[Collection[str], Collection[str]]] = {
            "mode": (self.modes, MODES),
            "task": (self.tasks, TASKS),
            "form": (self.forms, FORMS),
            "allow": (self.allow, ALLOWED),
            "robot": ((self.robot,), ROBOTS),
            "question": (asked, asked),
            "mode in [instructions]": (self.instructions, self.modes),
        }
        for thing, (names, choices) in chosen.items():
            if len(set(names)) < len(names):
                raise HandrailError(f"{thing}: expected each once, got {', '.join(names)}")
            check_known(thing, names, choices)
        description = load_description(self.robot)
        for mode in self.modes:
            description.check_hands(f"mode {mode}", MODES[mode].hands)
        for task in self.tasks:
            check_robot(task, description)
        if not (self.modes and self.tasks):
            raise HandrailError("modes and tasks: expected one or more of each, got none")
        if {"tlx", "tlx_raw"} <= set(self.forms):
            raise HandrailError("forms: expected tlx or tlx_raw (which has no comparisons), got both")
        if any(question.when == "condition" for question in self.questions) != ("questions" in self.forms):
            raise HandrailError(
                "forms: expected 'questions' among them exactly if a [[questions]] is asked after each"
                f" condition, got {', '.join(self.forms) or 'none'}"
            )
        for mode in self.modes:
            for task in self.tasks:
                self.recording(mode, task, Path("data")).check()

    @property
    def source(self) -> str:
        """The origin of the data, as every table says it."""
        return DEMO if self.demo else PEOPLE

    def recording(self, mode: str, task: str, folder: Path) -> RecordConfig:
        """Return the settings with which a task is recorded in a mode, into a dataset new or added to."""
        return RecordConfig(
            task=task,
            mode=mode,
            operator="browser",
            robot=self.robot,
            cameras=",".join(self.cameras),
            image_size=self.image_size,
            time_limit=self.time_limit,
            seed=self.seed,
            dataset=DatasetConfig(place=str(folder), repo_id="handrail/user_study", fps=self.fps),
            resume=(folder / "meta" / "handrail.json").exists(),
        )
