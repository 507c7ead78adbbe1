"""What `handrail-evaluate` runs, as typed settings; light to import."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from msgspec import Meta

from handrail.collect.config import FPS_RANGE, MOST_TIME, check_fps
from handrail.collect.execution.config import ExecutionConfig
from handrail.collect.flags import check_file, check_names, names, one_of, only_one
from handrail.collect.operators.modes import MODES
from handrail.collect.seeds import MOST_ROLLOUTS, evaluation_seed
from handrail.collect.session.perturbations import Perturbation
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.errors import HandrailError
from handrail.controllers.typed import Count, check_settings
from handrail.datasets.advanced import Advanced
from handrail.datasets.lists import Names, Words

PROTECTIONS = ("own", "none", "mpc", "filter")


@dataclass(frozen=True)
class EvaluateConfig(ExecutionConfig):
    """Run trained policies on declared seeds, with and without the MPC's protection, undisturbed or not."""

    policy: Words = ()
    """The same as FOLDER …"""
    json: str = ""
    """Write every rollout to this file; what is in it already is not run again."""
    episodes: Annotated[int, Meta(ge=1, le=MOST_ROLLOUTS)] = 100
    """Rollouts of each policy under each condition."""
    seed: Advanced[Annotated[int, Meta(ge=0, le=10**9)]] = 0
    """Seed of the evaluation: which beginnings and disturbances; never those of a recording."""
    protection: Names = "own"
    """The controller between policy and robot, one or more: own (an intent's own controller; none for joint
    velocities), none, mpc, filter."""
    perturbation: Names = "none"
    """Disturbances, one or more: none, push, shift, delay, camera, blank, swap, with a size such as push:2
    or delay:5, joined by + to have several at once."""
    label: Advanced[str] = ""
    """Name of the condition; the teleop mode, and what is special about it, when empty."""
    task: Advanced[Annotated[str, one_of(TASKS)]] = ""
    """The task, if a policy does not say it (lerobot-train's) or says a module:name."""
    mode: Advanced[str] = ""
    """The teleop mode whose channels a policy of lerobot-train writes. Of policies that say a module:name:
    it is imported only if you say it too."""
    robot: Advanced[str] = ""
    """The robot of policies that do not say it, or that say a module:name."""
    hand: Advanced[str] = ""
    """Which hand does the task, of a robot with several; that of the demonstrations by default."""
    fps: Advanced[Count] = 0
    """Decisions a second of such policies [Hz]; 0: those of their dataset, or 20 where that is not there."""
    time_limit: Advanced[Annotated[float, Meta(ge=0, le=MOST_TIME)]] = 0.0
    """Time after which a rollout is given up [s]; when 0, that of the demonstrations, or the task's own."""
    video: str = ""
    """Also film the first rollout to this .mp4 file (needs OpenGL)."""
    checkpoints: Annotated[tyro.conf.Positional[Words], tyro.conf.arg(metavar="FOLDER [FOLDER …]")] = ()
    """Checkpoint folders; several training seeds of one condition add up."""

    @property
    def folders(self) -> tuple[Path, ...]:
        """The checkpoint folders."""
        given = only_one(self.checkpoints, self.policy, "--policy")
        return tuple(Path(folder).expanduser() for folder in given)

    @property
    def protections(self) -> tuple[str, ...]:
        """The protections asked for."""
        return names(self.protection, PROTECTIONS)

    @property
    def perturbations(self) -> tuple[Perturbation, ...]:
        """The perturbations asked for, each a condition of its own."""
        return tuple(Perturbation.parse(text) for text in names(self.perturbation, ()))

    @property
    def seeds(self) -> tuple[int, ...]:
        """The seeds of the episodes: `2³² + 10⁶ seed + i`, i from 0; those of recordings are below 2³²."""
        return tuple(evaluation_seed(self.seed, episode) for episode in range(self.episodes))

    def check(self) -> None:
        """Check what can be checked without loading anything heavy."""
        check_settings(self, "--")
        self.check_execution()
        if self.task:
            TASKS.check(self.task)
        if self.mode:
            MODES.check(self.mode)
        check_fps(self.fps or FPS_RANGE[0], "--fps")
        check_names("protection", "--protection", self.protections, PROTECTIONS)
        if not self.perturbations or len(set(self.perturbations)) != len(self.perturbations):
            raise HandrailError(f"--perturbation {self.perturbation}: expected one or more, each once")
        if not self.folders:
            raise HandrailError("policy: expected one checkpoint folder or more, as outputs/act; got none")
        check_file("--json", self.json, ".json")
        check_file("--video", self.video, ".mp4")
