"""Settings of the bench `operators`, and the file of its trials: one line an episode."""

from dataclasses import dataclass, field
from typing import Annotated

from msgspec import Meta

from handrail.collect.execution.config import ExecutionConfig
from handrail.collect.flags import check_file, check_names, names
from handrail.collect.operators.modes import MODES
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.errors import HandrailError
from handrail.controllers.registry import fitting
from handrail.controllers.robot.description import load_description
from handrail.controllers.typed import AtLeastOne, Count, check_settings
from handrail.controllers.versions import SIMULATION
from handrail.datasets.lists import Names
from handrail.scripts.bench.report import ReportConfig, Rows

SLOW_MODE = "direct_single"  # needs more time than the tasks give
SLOW_LIMITS = {"drawer": 180.0, "pick_place": 180.0, "reach": 60.0, "tray": 180.0}  # [s]


@dataclass(frozen=True)
class TrialsConfig(ReportConfig, ExecutionConfig):
    """Let the scripted operators do every task in every mode, and count how it went."""

    tasks: Names = "all"
    """Which tasks, or all: drawer, pick_place, reach, tray."""
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
        return names(self.tasks, fitting(TASKS, self._hands))

    @property
    def mode_names(self) -> tuple[str, ...]:
        """The modes asked for."""
        return names(self.modes, fitting(MODES, self._hands))

    @property
    def _hands(self) -> int:
        return len(load_description(self.robot).hands)

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
