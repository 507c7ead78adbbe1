"""Settings of the bench `goal_reaching`; light to import."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from handrail.collect.execution.config import ExecutionConfig
from handrail.collect.flags import check_names, names, one_of
from handrail.controllers.errors import HandrailError
from handrail.controllers.typed import AtLeastOne, Count
from handrail.datasets.lists import Names
from handrail.scripts.bench.goal_reaching.catalogue import BASELINES
from handrail.scripts.bench.report import ReportConfig

PROFILES = ("nominal", "fast15", "fast2", "fast3", "steps", "noise", "delay", "dropouts", "quantised")


@dataclass(frozen=True)
class BenchmarkConfig(ReportConfig, ExecutionConfig):
    """Run the paper's goal-reaching benchmark: every controller on the same goals, with the same planner."""

    controllers: Annotated[Names, one_of(BASELINES)] = "all"
    """Which controllers, or all."""
    goals: AtLeastOne = 100
    """Goals, the same for every controller."""
    seed: Count = 1
    """Of the goals, obstacles and command noise."""
    profile: Names = "nominal"
    """How the planner's twist arrives, one or more, or all: nominal, fast15, fast2, fast3, steps, noise,
    delay, dropouts, quantised."""
    physics: bool = True
    """MuJoCo physics; without it an ideal robot that does what it is told."""
    clutter: bool = False
    """Cylinders on the floor, between start and goal too."""
    early_stop: bool = True
    """End an episode at its success, as the protocol says; else 4 s after the planner's last step."""
    closed_loop: bool = False
    """The planner sees the hand and corrects its errors, instead of running open loop."""
    workers: int = field(default=1, kw_only=True)
    """Processes that share the work; 0 for as many as there are cores, which makes all times longer."""
    report: str = ""
    """Write an HTML report with figures and a video to this folder."""
    video: bool = True
    """Whether the report has an example video, the page a strip of pictures (needs OpenGL)."""

    @property
    def controller_names(self) -> tuple[str, ...]:
        """The controllers asked for."""
        return names(self.controllers, BASELINES)

    @property
    def profile_names(self) -> tuple[str, ...]:
        """The profiles asked for."""
        return names(self.profile, PROFILES)

    @property
    def label(self) -> str:
        """A name of this kind of run: what is special about it, and the seed."""
        profiles = self.profile_names
        kinds = ["profiles"] if set(profiles) == set(PROFILES) else list(profiles)
        kinds += [name for name in ("clutter", "closed_loop") if getattr(self, name)]
        kinds += [word for word, there in (("whole", self.early_stop), ("ideal", self.physics)) if not there]
        return "_".join([*kinds, f"seed_{self.seed}"])

    def check(self) -> None:
        """Check what can be checked without loading anything heavy."""
        super().check()
        check_names("controller", "--controllers", self.controller_names, BASELINES)
        check_names("profile", "--profile", self.profile_names, PROFILES)
        self.check_execution()
        if self.report and Path(self.report).expanduser().is_file():
            raise HandrailError(f"--report {self.report}: expected a folder, found a file")
