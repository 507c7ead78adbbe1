"""The settings of a recording session, typed; light to import."""

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro
from msgspec import Meta

from handrail.collect.client_config import ClientConfig
from handrail.collect.cockpit_config import CockpitConfig
from handrail.collect.execution.config import ExecutionConfig
from handrail.collect.flags import check_file, check_names, names, one_of, only_one
from handrail.collect.operators.catalogue import OPERATORS
from handrail.collect.operators.modes import MODES
from handrail.collect.operators.scripted.human import HumanSettings
from handrail.collect.policy_config import PolicyConfig
from handrail.collect.teleop_config import TeleopConfig
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.errors import HandrailError, shown
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.typed import AtLeastOne, Count, check, check_settings
from handrail.datasets.advanced import Advanced
from handrail.datasets.lists import Names

_Side = Annotated[int, Meta(ge=16, le=1024, multiple_of=2)]
REPO_ID = "handrail/demo"  # of a dataset whose name nobody says
FOUND = Path("outputs/cockpit")  # of datasets whose folders nobody says
FPS_RANGE = (10, 100)
WORTH_SHARING = 100  # episodes from which on several processes are quicker than one
MOST_MOVING = 4
MOST_TIME = 3600.0  # [s]
_ONE_PROCESS = ("policy", "robot_client", "realtime", "display_data", "display_web", "display_save")


@dataclass(frozen=True)
class SessionConfig:
    """The operator, the task, the mode and the display of a session."""

    task: Annotated[str, one_of(TASKS)] = "pick_place"
    """The task."""
    mode: Annotated[str, one_of(MODES)] = "ee"
    """Teleop mode: what the operator steers, and what becomes of it."""
    mask: Advanced[str] = ""
    """A mask of your own instead of the mode's: 0 or 1 for each channel (base twist, tool twist, joints)."""
    operator: Annotated[str, one_of(OPERATORS)] = "scripted"
    """The operator."""
    noise: Advanced[Annotated[float, Meta(ge=0, le=5)]] = 1.0
    """How human the scripted hand is: 0 perfect, 1 the default, partly from studies of people."""
    human: Advanced[HumanSettings] = field(default_factory=HumanSettings)
    person: Advanced[Count] = 0
    """Which person the scripted operator is; persons differ in delay, noise and all the rest."""
    time_limit: Annotated[float, Meta(ge=0, le=MOST_TIME)] = 0.0
    """Time after which an episode ends, saved as failed [s]; the task's own when 0."""
    moving_obstacles: Advanced[Annotated[int, Meta(ge=0, le=MOST_MOVING)]] = 0
    """Obstacles that cross the robot's way at up to 0.5 m/s, 0 to 4; task reach only."""
    robot: Annotated[str, one_of(ROBOTS)] = "ridgeback_ur10"
    """A robot, or a description file (.toml)."""
    seed: Count = 0
    """Seed of scenes and operator: the same seed and versions give the same data."""
    cameras: Names = ""
    """Cameras of the robot to record, such as front,wrist; scene overlooks it; all, or none by default."""
    image_size: Advanced[int | str] = 128
    """Size of the pictures [pixels]: of a square's side, or WIDTHxHEIGHT."""
    hand: Advanced[str] = ""
    """Which hand does the task, of a robot with several: its name; the first by default."""
    randomise: bool = False
    """Draw light, colours, textures, camera poses and fields of view anew in each episode, from its seed."""
    realtime: Advanced[bool] = False
    """Pace the loop by the wall clock."""
    physics: Advanced[bool] = True
    """MuJoCo; without, an ideal robot does exactly as it is told (task reach, no cameras)."""
    robot_fps: Advanced[int] = 0
    """How often the robot is sent a command [Hz], a multiple of the recording rate; that rate when 0."""
    control_fps: Advanced[int] = 0
    """How often the controller is asked [Hz], a divisor of the robot's rate; the recording rate when 0."""

    @property
    def camera_names(self) -> tuple[str, ...]:
        """The cameras asked for."""
        return names(self.cameras, self._robot_cameras) if self.cameras else ()

    @property
    def _robot_cameras(self) -> tuple[str, ...]:
        from handrail.controllers.robot.description import load_description

        return load_description(self.robot).camera_names

    @property
    def image_shape(self) -> tuple[int, int]:
        """Height and width of the pictures [px]."""
        width, times, height = str(self.image_size).partition("x")
        sides = (height, width) if times else (width, width)
        if not all(side.isdecimal() for side in sides):
            raise HandrailError(f"--image_size: expected 128 or 160x120, got {shown(self.image_size)}")
        first, second = (check(int(side[:9]), _Side, "--image_size") for side in sides)
        return first, second

    @property
    def mode_name(self) -> str:
        """Its name in the data: the mode's name, or the mask that is steered with instead."""
        return f"mask:{self.mask}" if self.mask else self.mode

    def check(self) -> None:
        """Check what can be checked without loading anything heavy."""
        TASKS.check(self.task)
        MODES.check(self.mode)
        OPERATORS.check(self.operator)
        if self.camera_names:
            check_names("camera", "--cameras", self.camera_names, self._robot_cameras)
        check_settings(self, "--")
        self.image_shape  # noqa: B018
        if self.moving_obstacles and not TASKS.find(self.task).movers:
            fit = " or ".join(spec.name for spec in TASKS.built_in if spec.movers)
            raise HandrailError(f"--moving_obstacles: expected --task {fit}, got --task {self.task}")
        if not self.physics and (self.task != "reach" or self.camera_names or self.randomise):
            raise HandrailError(
                "--no_physics: expected --task reach without cameras or --randomise: nothing moves or is seen"
            )


@dataclass(frozen=True)
class StoredConfig:
    """Where a dataset is; the flags are LeRobot's."""

    repo_id: str = ""
    """Name of the dataset, owner/name; without a folder it is in LeRobot's own place for this name."""
    root: str = ""
    """The same as FOLDER."""
    place: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="FOLDER")] = ""
    """Folder of the dataset."""

    @property
    def name(self) -> str:
        """Its name."""
        return self.repo_id or REPO_ID

    @property
    def folder(self) -> Path:
        """The folder of the dataset: as given, or where LeRobot keeps its own."""
        if given := only_one(self.place, self.root, "--dataset.root"):
            return Path(given).expanduser()
        if not self.repo_id:
            raise HandrailError(
                "dataset: expected its folder, such as outputs/reach, or --dataset.repo_id; got neither"
            )
        hub = Path(os.environ.get("HF_HOME", "~/.cache/huggingface"), "lerobot")
        return Path(os.environ.get("HF_LEROBOT_HOME", hub)).expanduser() / self.repo_id


@dataclass(frozen=True)
class DatasetConfig(StoredConfig):
    """Where the episodes go, how many, how fast; the flags are LeRobot's."""

    num_episodes: AtLeastOne = 10
    """Episodes to record."""
    fps: Advanced[int] = 20
    """Control and recording rate [Hz], 10 to 100."""
    single_task: Advanced[str] = ""
    """The task in words; the task's own sentence when empty."""

    def check(self) -> None:
        """Check the settings."""
        _ = self.folder
        check_fps(self.fps)
        check_settings(self, "--dataset.")


@dataclass(frozen=True)
class FoundDatasetConfig(DatasetConfig):
    """Where the episodes go, how many, how fast; without a folder, one is found."""

    place: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="FOLDER")] = ""
    """Folder of the dataset, new or to add to; by default outputs/cockpit/TASK, or TASK-2, …"""

    @property
    def is_found(self) -> bool:
        """Whether nobody said the folder."""
        return not (self.place or self.root or self.repo_id)

    @property
    def folder(self) -> Path:
        """The folder of the dataset, or that of all whose folders nobody said."""
        return FOUND if self.is_found else super().folder


@dataclass(frozen=True)
class RecordConfig(SessionConfig, PolicyConfig, ExecutionConfig):
    """Record demonstrations of a robot steered through the masked MPC as a LeRobot dataset."""

    workers: int = field(default=0, kw_only=True)
    """Processes that share the work, one core each; 0: all cores from 100 scripted episodes on, else 1."""
    dataset: DatasetConfig = field(default_factory=DatasetConfig)
    resume: bool = False
    """Add to the dataset that is there; what a crash left behind is cleared first."""
    verify: Advanced[bool] = False
    """With --resume: read every file anew, not only those that have changed since they were checked."""
    overwrite: bool = False
    """Remove the dataset that is there, if Handrail recorded it."""
    cockpit: Advanced[CockpitConfig] = field(default_factory=CockpitConfig)
    teleop: Advanced[TeleopConfig] = field(default_factory=TeleopConfig)
    robot_client: Advanced[str] = ""
    """Drive this robot of LeRobot's through its client instead of a simulation: lekiwi."""
    client: Advanced[ClientConfig] = field(default_factory=ClientConfig)
    display_data: bool = False
    """Show robot, cameras, intent and distances in rerun's viewer (needs a screen)."""
    display_web: Advanced[bool] = False
    """Show that in a browser on this machine instead."""
    display_save: Advanced[str] = ""
    """Save what rerun would show to this .rrd file."""

    def check(self) -> None:
        """Check what can be checked without loading anything heavy."""
        super().check()
        self.dataset.check()
        self.cockpit.check()
        self.teleop.check(self.operator)
        self.client.check(self.robot_client, self.operator)
        if self.robot_client and (self.moving_obstacles or self.randomise or not self.physics):
            words = "expected none of --moving_obstacles, --randomise, --no_physics"
            raise HandrailError(f"--robot_client {self.robot_client}: {words}")
        self.check_policy(self.operator)
        real = self.robot_client and not self.client.simulated
        if real and not OPERATORS.find(self.operator).interactive:
            raise HandrailError(f"--operator {self.operator}: expected a person, to stop the robot")
        self._check_rates()
        self._check_sharing()
        for one, other in (("resume", "overwrite"), ("display_data", "display_web")):
            if getattr(self, one) and getattr(self, other):
                raise HandrailError(f"--{one} and --{other}: expected one of them, got both")
        check_file("--display_save", self.display_save, ".rrd")

    @property
    def processes(self) -> int:
        """How many processes share the work on this computer: as many as are asked for, or as pay."""
        pays = self.dataset.num_episodes >= WORTH_SHARING and not self._in_one_process
        return super().processes if self.workers or pays else 1

    @property
    def _in_one_process(self) -> str:
        """The flag because of which one process has to record; empty if several may."""
        if OPERATORS.find(self.operator).interactive:
            return f"--operator {self.operator}"
        return next((f"--{name}" for name in _ONE_PROCESS if getattr(self, name)), "")

    def _check_sharing(self) -> None:
        """Check that the episodes may be recorded anywhere and in any order, if they are to be."""
        self.check_execution()
        if self.is_shared and (alone := self._in_one_process):
            flag = f"--ray {self.ray}" if self.ray else f"--workers {self.workers}"
            raise HandrailError(f"{flag}: expected a recording without {alone}, which is of one process")

    def _check_rates(self) -> None:
        fps, control, (low, high) = self.dataset.fps, self.control_fps, FPS_RANGE
        robot = self.robot_fps or fps
        if robot % fps or not fps <= robot <= high:
            raise HandrailError(
                f"--robot_fps {robot}: expected a multiple of --dataset.fps {fps}, at most {high}"
            )
        if control and (control < low or robot % control):  # else updates come late
            raise HandrailError(
                f"--control_fps {control}: expected a divisor of the robot's rate {robot}, at least {low}"
            )


@dataclass(frozen=True)
class DriveConfig(RecordConfig):
    """Drive a robot in a browser, and record demonstrations as a LeRobot dataset."""

    task: Annotated[str, one_of(TASKS)] = "reach"
    """The task."""
    dataset: FoundDatasetConfig = field(default_factory=FoundDatasetConfig)
    cockpit: CockpitConfig = field(default_factory=CockpitConfig)

    # no flags: they mean nothing where a person at a browser drives a simulation
    operator: tyro.conf.Suppress[str] = "browser"
    noise: tyro.conf.Suppress[float] = 1.0
    realtime: tyro.conf.Suppress[bool] = False
    human: tyro.conf.Suppress[HumanSettings] = field(default_factory=HumanSettings)
    person: tyro.conf.Suppress[int] = 0
    teleop: tyro.conf.Suppress[TeleopConfig] = field(default_factory=TeleopConfig)
    robot_client: tyro.conf.Suppress[str] = ""
    client: tyro.conf.Suppress[ClientConfig] = field(default_factory=ClientConfig)
    workers: tyro.conf.Suppress[int] = field(default=0, kw_only=True)
    ray: tyro.conf.Suppress[str] = field(default="", kw_only=True)


def check_fps(fps: int, flag: str = "--dataset.fps") -> None:
    """Check a control and recording rate [Hz]."""
    low, high = FPS_RANGE
    if not low <= fps <= high:
        raise HandrailError(f"{flag} {fps}: expected {low} to {high}")
