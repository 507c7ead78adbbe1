"""Lets scripted operators do tasks in teleop modes; how each episode went is a line in a file."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import product
from typing import Annotated, Any, cast

import numpy as np
from msgspec import Meta

from handrail.collect.config import SessionConfig
from handrail.collect.execution.config import ExecutionConfig
from handrail.collect.execution.execution import Execution
from handrail.collect.execution.job import Job
from handrail.collect.flags import check_file, check_names, names
from handrail.collect.operators.modes import MODES
from handrail.collect.operators.scripted.scripted import ScriptedOperator
from handrail.collect.seeds import episode_seed
from handrail.collect.session.build import build_controller, build_env, build_mode, build_operator
from handrail.collect.session.session import Session
from handrail.collect.world.env import HandrailEnv
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.baselines.catalogue import CONTROLLERS
from handrail.controllers.errors import HandrailError
from handrail.controllers.registry import fitting
from handrail.controllers.robot.description import load_description
from handrail.controllers.typed import AtLeastOne, Count, check_settings
from handrail.controllers.versions import SIMULATION
from handrail.datasets.lists import Names
from handrail.datasets.presentation.table import Table
from handrail.datasets.presentation.terminal import Terminal
from handrail.datasets.recording.frames import Frame
from handrail.datasets.statistics.paired import wilson
from handrail.scripts.bench.report import ReportConfig, Rows, report

_PRELOAD = ("handrail.scripts.bench.operators.trials",)
_FPS = 20  # [Hz]
_PLACES = 4  # digits that are kept
_OF_OUTCOME = (*("success", "failure_reason", "seconds", "frames", "smallest_distance", "brakes"),)
SLOW_MODES = ("direct_single", "direct_erring")  # need more time than the tasks give
SLOW_LIMITS = {"drawer": 180.0, "pick_place": 180.0, "reach": 60.0, "tray": 180.0}  # [s]


@dataclass(frozen=True)
class TrialsConfig(ReportConfig, ExecutionConfig):
    """Let the scripted operators do every task in every mode, and count how it went."""

    tasks: Names = "all"
    """Which tasks, or all that the robot can do."""
    modes: Names = "ee,switching,base+ee,direct,direct_single,leader,decoupled"
    """Which teleop modes, or all."""
    episodes: AtLeastOne = 20
    """Episodes of each task in each mode; the same beginnings in all modes."""
    persons: AtLeastOne = 5
    """Scripted operators, who take turns episode by episode."""
    noise: Annotated[float, Meta(ge=0, le=5)] = 1.0
    """How human they are: 0 perfect, 1 the default, partly from studies of people."""
    robot: str = "ridgeback_ur10"
    """A robot that comes with Handrail, or a `.toml` file."""
    seed: Count = 900
    """Of scenes and operators."""
    json: str = field(default="outputs/trials.json", kw_only=True)
    """Every episode is added to this file at once; what it has already is not run again."""

    @property
    def task_names(self) -> tuple[str, ...]:
        """The tasks asked for."""
        robot = load_description(self.robot)
        return names(self.tasks, [name for name, spec in TASKS.items() if not spec.lacks(robot)])

    @property
    def mode_names(self) -> tuple[str, ...]:
        """The modes asked for."""
        robot = load_description(self.robot)
        fit = fitting(MODES, len(robot.hands)).items()
        return names(
            self.modes, [name for name, each in fit if CONTROLLERS.find(each.controller).fits(robot)]
        )

    def check(self) -> None:
        """Check what can be checked without loading anything heavy."""
        check_settings(self, "--")
        check_names("task", "--tasks", self.task_names, TASKS)
        check_names("mode", "--modes", self.mode_names, MODES)
        if not self.json.endswith(".json"):
            raise HandrailError(f"--json {self.json}: expected a file that ends in .json")
        check_file("--page", self.page, ".md")
        self.check_execution()


FORMAT = "handrail.trials/1"


@dataclass(frozen=True)
class OperatorTrial:
    """How one episode went."""

    task: str  # what was done
    mode: str  # in which teleop mode
    episode: int  # its number; scenes are the same in all modes
    person: int  # who steered
    success: bool  # whether the task was done
    failure_reason: str  # why not
    seconds: float  # simulated time [s]
    frames: int  # control periods
    contacts: int  # forbidden contacts that began; in files that name no robot, control periods with one
    smallest_distance: float  # signed, tool against work surfaces left out [m]
    brakes: int  # updates in which the controller braked the robot
    switches: int  # how often the operator changed to other channels
    switching: float  # time for which their hands were away from the input meanwhile [s]


def trials_file(config: TrialsConfig) -> Rows[OperatorTrial]:
    """Return the file of the trials of one robot, seed, noise and number of persons."""
    settings = {name: getattr(config, name) for name in ("robot", "seed", "noise", "persons")}
    head = {"format": FORMAT} | settings
    return Rows(config.json, head, OperatorTrial, trial_key, SIMULATION, "trials")


def trial_key(trial: OperatorTrial) -> tuple[str, str, int]:
    """Return what tells a trial from the others of its file."""
    return trial.task, trial.mode, trial.episode


HEADINGS = (
    *("mode", "success", "95 %", "failures", "time of successes [s]", "episodes with contact"),
    *("smallest distance [m]", "braked updates", "switches", "time in switches"),
)
_WORDS = (
    "Time: mean ± SD. 95 %: Wilson. Contacts are forbidden ones. Switches: mean an episode; time in "
    "switches: share of all time in which the hands are away from the input to change to other channels."
)


def trials_table(trials: Sequence[OperatorTrial], modes: Sequence[str], task: str) -> Table:
    """Return a task's table: a line for each mode that has trials."""
    groups = [[each for each in trials if (each.task, each.mode) == (task, mode)] for mode in modes]
    return Table(HEADINGS, [_line(group) for group in groups if group], task, _WORDS)


def _line(group: Sequence[OperatorTrial]) -> list[str]:
    successes = [trial.seconds for trial in group if trial.success]
    low, high = wilson(len(successes), len(group))
    failures = Counter(trial.failure_reason for trial in group if not trial.success)
    brakes, frames = sum(trial.brakes for trial in group), sum(trial.frames for trial in group)
    seconds = sum(trial.seconds for trial in group)
    return [
        group[0].mode,
        f"{len(successes)} of {len(group)}",
        f"{100 * low:.0f} to {100 * high:.0f} %",
        ", ".join(f"{why} ({count})" for why, count in failures.most_common()) or "–",
        f"{np.mean(successes):.1f} ± {np.std(successes):.1f}" if successes else "–",
        str(sum(trial.contacts > 0 for trial in group)),
        f"{min(trial.smallest_distance for trial in group):.3f}",
        f"{brakes} of {frames}",
        f"{np.mean([trial.switches for trial in group]):.1f}",
        f"{100 * sum(trial.switching for trial in group) / seconds:.1f} %",
    ]


def run_trials(config: TrialsConfig, told: Callable[[OperatorTrial], None]) -> list[OperatorTrial]:
    """Run what is not in the file yet, and return every episode that was asked for, in order.

    Args:
        config: of the trials.
        told: of each episode that was run.
    """
    config.check()
    file = trials_file(config)
    settings = replace(config, workers=1, ray="", json="trials.json", page="")  # what an episode depends on
    cells = product(config.task_names, config.mode_names, range(config.episodes))
    keys = [key for key in cells if not TASKS.find(key[0]).refuses(MODES.find(key[1]).groups("hand"))]
    jobs = [Job(" ".join(map(str, key)), run_trial, (settings, *key)) for key in keys if key not in file]
    with Execution(config, "episodes", preload=_PRELOAD) as execution:
        for result in execution.run(jobs):
            if result.error:
                raise HandrailError(f"{result.job.name}: {result.error}")
            file.add(result.value)
            told(result.value)
    return [file[key] for key in keys]


def run_trial(config: TrialsConfig, task: str, mode: str, episode: int) -> OperatorTrial:
    """Return how one episode went; person `i mod persons` does episode i."""
    person = episode % config.persons
    session, hands = _watched(config, task, mode, person)
    outcome = session.run(episode_seed(config.seed, episode))
    went: dict[str, Any] = {name: getattr(outcome, name) for name in _OF_OUTCOME}
    went |= {"contacts": outcome.contact_onsets}
    went |= {"switches": hands.switches, "switching": hands.away / _FPS}
    kept: dict[str, Any] = {
        name: round(each, _PLACES) if isinstance(each, float) else each for name, each in went.items()
    }
    return OperatorTrial(task, mode, episode, person, **kept)


@lru_cache(maxsize=16)
def _watched(config: TrialsConfig, task: str, mode: str, person: int) -> "tuple[Session, _Hands]":
    """Return the session of a person, built once a process."""
    limit = SLOW_LIMITS.get(task, 0.0) if mode in SLOW_MODES else 0.0
    settings = SessionConfig(
        task=task, mode=mode, robot=config.robot, noise=config.noise, person=person, time_limit=limit
    )
    env = _env(replace(settings, person=0))
    taken = build_mode(settings, env.model)
    operator = cast(ScriptedOperator, build_operator(settings, taken, env.model))
    hands = _Hands(operator)
    return Session(env, build_controller(taken, env.model, env.fps, task), operator, [hands]), hands


@lru_cache(maxsize=2)
def _env(config: SessionConfig) -> HandrailEnv:
    """Return the environment of a task in a mode, built once a process."""
    return build_env(config, _FPS)


class _Hands:
    """Counts how often an operator changes to other channels, and the frames their hands are away for it."""

    def __init__(self, operator: ScriptedOperator) -> None:
        self._operator = operator

    def begin(self, env: HandrailEnv, seed: int) -> None:
        self._mask = b""
        self.switches = self.away = 0

    def see(self, frame: Frame) -> None:
        mask = frame.intent.mask.tobytes()
        self.switches += self._mask not in (b"", mask)
        self.away += frame.intent.time < self._operator.free_at
        self._mask = mask


def main(config: TrialsConfig) -> int:
    """Run the trials and print the tables."""
    console = Terminal()
    trials = run_trials(
        config,
        lambda done: console.print(
            f"{done.task} {done.mode} {done.episode}: {done.failure_reason or 'done'}, {done.seconds:.1f} s"
        ),
    )
    report("operators", config, [trials_table(trials, config.mode_names, task) for task in config.task_names])
    return 0
