"""Settings of the bench `speed`; light to import."""

from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from handrail.collect.flags import check_names, names
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.typed import AtLeastOne, Count
from handrail.datasets.lists import Names
from handrail.scripts.bench.report import ReportConfig


@dataclass(frozen=True)
class ProfileConfig(ReportConfig):
    """Measure the controller's update against IPOPT and mink, and its QP solver against DAQP and PIQP."""

    updates: Annotated[int, Meta(ge=10)] = 400
    """Timed updates of every case."""
    seed: Count = 0
    """Of scenes and intents."""
    rivals: bool = True
    """Also measure IPOPT and mink."""
    growth: bool = True
    """Also measure longer horizons, more pairs and another robot."""
    solves: AtLeastOne = 40
    """Converged solves of IPOPT a case."""
    qps: Count = 100
    """QPs of every case that DAQP and PIQP solve too; 0 for none."""
    tasks: Names = "reach,pick_place"
    """Tasks that the scripted operator does meanwhile in mode ee, in their own table; or all."""
    robots: Names = "lekiwi,ridgeback_ur10"
    """Robots that do these tasks; or all."""

    def check(self) -> None:
        """Check the settings."""
        super().check()
        check_names("task", "--tasks", names(self.tasks, TASKS), TASKS)
        check_names("robot", "--robots", names(self.robots, ROBOTS), ROBOTS)
