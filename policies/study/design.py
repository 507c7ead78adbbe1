"""What a study consists of: modes, tasks and seeds, read from a TOML file; light to import.

modes = ["ee", "direct"]        the first that a baseline is compared with, and so on
baseline = "direct"
policy = "act"
seeds = [0, 1, 2]               of the trainings
rollouts = 100                  of each policy, on the same seeds for all
persons = 5                     scripted operators, who take turns

[tasks.reach]
episodes = 50                   successful demonstrations of each mode, at least
minutes = 10.0                  of the operator's time with each mode, failed attempts included
steps = 4000                    updates of each policy
time_limit = {direct_single = 60.0}     [s]

[robustness]                    optional
perturbations = ["push", "shift", "delay"]
protections = ["mpc", "filter"]
rollouts = 50

[sweep]                         optional: how human the operator is
tasks = ["reach"]
noises = [0.0, 2.0]
seeds = [0]
"""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import draccus

from handrail.collect.config import MODE_NAMES, TASKS
from handrail.controllers.errors import HandrailError, unknown_name

PRESETS = Path(__file__).parent / "presets"
BUDGETS = ("time", "number")
MPC_MODES = ("ee", "base", "base+ee", "joints", "switching")


@dataclass(frozen=True)
class TaskDesign:
    """One task of a study.

    Attributes:
        episodes: successful demonstrations of each mode, at least; the budget `number`.
        minutes: of the operator's time with each mode, failed attempts included; the budget `time`.
        steps: updates of each policy.
        batch_size: samples an update; 0 for the preset's.
        time_limit: of an episode by mode [s]; the task's own where a mode is not named.
        policy_options: more of LeRobot's settings of the policy, `key=value` each.
    """

    episodes: int = 50
    minutes: float = 0.0
    steps: int = 4000
    batch_size: int = 0
    time_limit: Mapping[str, float] = field(default_factory=dict)
    policy_options: tuple[str, ...] = ()


@dataclass(frozen=True)
class Robustness:
    """What else policies of the main design go through.

    Attributes:
        perturbations: each a condition of its own.
        protections: of policies that command joint velocities.
        rollouts: under each condition.
        seeds: of the trainings whose policies do.
    """

    perturbations: tuple[str, ...] = ("push", "shift", "delay")
    protections: tuple[str, ...] = ("filter",)
    rollouts: int = 50
    seeds: tuple[int, ...] = (0,)


@dataclass(frozen=True)
class Sweep:
    """How the ranking depends on how human the operator is.

    Attributes:
        tasks: some of the study's.
        noises: besides 1, which the study itself has.
        seeds: of the trainings.
    """

    tasks: tuple[str, ...]
    noises: tuple[float, ...] = (0.0, 2.0)
    seeds: tuple[int, ...] = (0,)


@dataclass(frozen=True)
class StudyDesign:
    """A whole study.

    Attributes:
        name: of the preset or file.
        modes: teleop modes.
        tasks: by name.
        baseline: the mode that the others are compared with.
        policy: that LeRobot has registered.
        seeds: of the trainings.
        rollouts: of each policy.
        budgets: `time`: what fits into the task's minutes; `number`: as many successes as its episodes.
        persons: scripted operators, who take turns.
        seed: of the scenes in which is recorded, and in which is evaluated.
        robustness: further conditions, if any.
        sweep: over the operator's noise, if any.
    """

    name: str
    modes: tuple[str, ...]
    tasks: Mapping[str, TaskDesign]
    baseline: str
    policy: str = "act"
    seeds: tuple[int, ...] = (0, 1, 2)
    rollouts: int = 100
    budgets: tuple[str, ...] = ("time",)
    persons: int = 5
    seed: int = 0
    robustness: Robustness | None = None
    sweep: Sweep | None = None

    def check(self) -> None:
        """Check every name and number.

        Raises:
            HandrailError: one is wrong; the message says what may be chosen.
        """
        if len(self.modes) < 2 or not self.tasks:
            raise HandrailError(
                f"study {self.name}: expected two modes or more and a task, "
                f"got {', '.join(self.modes) or 'no mode'}; {', '.join(self.tasks) or 'no task'}"
            )
        _known("mode", self.modes, MODE_NAMES)
        _known("task", self.tasks, TASKS)
        _known("baseline", (self.baseline,), self.modes)
        _known("budget", self.budgets, BUDGETS)
        if self.sweep:
            _known("task of the sweep", self.sweep.tasks, tuple(self.tasks))
        for name, value in (("rollouts", self.rollouts), ("persons", self.persons)):
            if value < 1:
                raise HandrailError(f"study {self.name}: {name} expected 1 or more, got {value}")
        for name, numbers in (("seeds", self.seeds), ("modes", self.modes), ("budgets", self.budgets)):
            if not numbers or len(set(numbers)) < len(numbers):
                raise HandrailError(f"study {self.name}: {name} expected some, each once, got {numbers}")
        for task, design in self.tasks.items():
            _known(f"mode in time_limit of {task}", tuple(design.time_limit), self.modes)
            if design.episodes < 2 or design.steps < 1 or design.minutes < 0:
                raise HandrailError(
                    f"study {self.name}, task {task}: expected episodes ≥ 2, steps ≥ 1, minutes ≥ 0, "
                    f"got {design.episodes}, {design.steps}, {design.minutes}"
                )
            if "time" in self.budgets and not design.minutes:
                raise HandrailError(f"study {self.name}, task {task}: the budget 'time' needs minutes")


def design_names() -> list[str]:
    """Return the studies that come with Handrail."""
    return sorted(path.stem for path in PRESETS.glob("*.toml"))


def load_design(name: str) -> StudyDesign:
    """Return a study by the name of a preset or the path of a TOML file.

    Raises:
        HandrailError: there is none, or something in it is wrong.
    """
    path = Path(name).expanduser() if name.endswith(".toml") else PRESETS / f"{name}.toml"
    if not path.is_file():
        raise unknown_name("study", name, [*design_names(), "a file that ends in .toml"])
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise HandrailError(f"study {name}: expected TOML, got {error}") from error
    design = _design(path.stem, content)
    design.check()
    return design


def _design(name: str, content: dict[str, Any]) -> StudyDesign:
    from draccus.utils import DecodingError, ParsingError

    try:
        return draccus.decode(StudyDesign, {"name": name, **content})
    except (DecodingError, ParsingError, TypeError, ValueError) as error:
        raise HandrailError(f"study {name}: {' '.join(str(error).split())}") from error


def _known(what: str, names: Any, choices: Any) -> None:
    for name in names:
        if name not in choices:
            raise unknown_name(what, name, choices)
