"""What a study consists of: modes, tasks and seeds, as a TOML file says; light to import.

modes = ["ee", "direct"]        teleop modes
baseline = "direct"             the mode that the others are compared with
policy = "act"                  that LeRobot has registered
seeds = [0, 1, 2]               of the trainings
rollouts = 100                  of each policy, on the same seeds for all
budgets = ["time", "number"]    what fits into the task's minutes; as many successes as its episodes
persons = 5                     scripted operators, who take turns
seed = 0                        of the scenes in which is recorded, and in which is evaluated

[tasks.reach]
episodes = 50                   successful demonstrations of each mode, at least; the budget "number"
minutes = 10.0                  of the operator's time with each mode, with failures; the budget "time"
steps = 4000                    updates of each policy
batch_size = 0                  samples an update; 0 for the preset's
policy_options = ["dropout=0.1"]        more of LeRobot's settings of the policy
time_limit = {direct_single = 60.0}     of an episode by mode [s]; the task's own where none is named
rollout_limit = 20.0            after which a policy's rollout has failed [s]; the task's own without it

[robustness]                    optional: what else policies of the main design go through
perturbations = ["push", "shift", "delay"]      each a condition of its own
protections = ["mpc", "filter"] of policies that command joint velocities
rollouts = 50                   under each condition
seeds = [0]                     of the trainings whose policies go through it

[sweep]                         optional: how human the operator is
tasks = ["reach"]
noises = [0.0, 2.0]             besides 1, which the study itself has
seeds = [0]
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from handrail.collect.operators.modes import MODES
from handrail.collect.tasks.catalogue import TASKS
from handrail.controllers.errors import HandrailError, unknown_name

BUDGETS = ("time", "number")


@dataclass(frozen=True)
class TaskDesign:
    """One task of a study; its settings are explained above."""

    episodes: int = 50
    minutes: float = 0.0
    steps: int = 4000
    batch_size: int = 0
    time_limit: Mapping[str, float] = field(default_factory=dict)
    rollout_limit: float = 0.0
    policy_options: tuple[str, ...] = ()


@dataclass(frozen=True)
class Robustness:
    """What else policies of the main design go through; explained above."""

    perturbations: tuple[str, ...] = ("push", "shift", "delay")
    protections: tuple[str, ...] = ("filter",)
    rollouts: int = 50
    seeds: tuple[int, ...] = (0,)


@dataclass(frozen=True)
class Sweep:
    """How the ranking depends on how human the operator is; explained above."""

    tasks: tuple[str, ...]
    noises: tuple[float, ...] = (0.0, 2.0)
    seeds: tuple[int, ...] = (0,)


@dataclass(frozen=True)
class StudyDesign:
    """A whole study, called after its file; its settings are explained above."""

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
        """Check every name, and what only a study asks; `check_jobs` checks the settings of its jobs.

        Raises:
            HandrailError: one is wrong; the message says what may be chosen.
        """
        if len(self.modes) < 2 or not self.tasks:
            raise HandrailError(
                f"study {self.name}: expected two modes or more and a task, "
                f"got {', '.join(self.modes) or 'no mode'}; {', '.join(self.tasks) or 'no task'}"
            )
        _known("mode", self.modes, MODES)
        _known("task", self.tasks, TASKS)
        _known("baseline", (self.baseline,), self.modes)
        _known("budget", self.budgets, BUDGETS)
        if self.sweep:
            _known("task of the sweep", self.sweep.tasks, tuple(self.tasks))
        if self.persons < 1:
            raise HandrailError(f"study {self.name}: persons expected 1 or more, got {self.persons}")
        for name, chosen in self._chosen():
            if not chosen or len(set(chosen)) < len(chosen):
                raise HandrailError(f"study {self.name}: {name} expected some, each once, got {chosen}")
        if self.robustness and not set(self.robustness.seeds) <= set(self.seeds):
            raise HandrailError(
                f"study {self.name}: robustness.seeds expected some of {self.seeds}, "
                f"got {self.robustness.seeds}"
            )
        for task, design in self.tasks.items():
            self._check_task(task, design)

    def _chosen(self) -> Iterator[tuple[str, tuple[Any, ...]]]:
        """Yield what there has to be one of, by name."""
        yield from (("seeds", self.seeds), ("modes", self.modes), ("budgets", self.budgets))
        if self.robustness:
            yield "robustness.seeds", self.robustness.seeds
            yield "robustness.perturbations", self.robustness.perturbations
        if self.sweep:
            yield from (("sweep.tasks", self.sweep.tasks), ("sweep.seeds", self.sweep.seeds))
            yield "sweep.noises", self.sweep.noises

    def _check_task(self, name: str, task: TaskDesign) -> None:
        """Check what only a study asks of a task; its jobs check the rest."""
        _known(f"mode in time_limit of {name}", tuple(task.time_limit), self.modes)
        if task.episodes < 2 or task.steps < 1 or not 0.0 <= task.minutes < math.inf:
            raise HandrailError(
                f"study {self.name}, task {name}: expected episodes ≥ 2, steps ≥ 1, minutes ≥ 0, "
                f"got {task.episodes}, {task.steps}, {task.minutes}"
            )
        if "time" in self.budgets and not task.minutes:
            raise HandrailError(f"study {self.name}, task {name}: the budget 'time' needs minutes")


def _known(what: str, names: Any, choices: Any) -> None:
    for name in names:
        if name not in choices:
            raise unknown_name(what, name, choices)
