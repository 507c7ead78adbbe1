"""Settings of the bench `speed`; light to import."""

from dataclasses import dataclass

from handrail.collect.flags import check_json, check_names, check_whole, names
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.datasets.lists import Names


@dataclass(frozen=True)
class ProfileConfig:
    """Measure the controller's update against IPOPT and mink, and its QP solver against DAQP and PIQP."""

    updates: int = 400
    """Timed updates of every case."""
    seed: int = 0
    """Of scenes and intents."""
    rivals: bool = True
    """Also measure IPOPT and mink."""
    growth: bool = True
    """Also measure longer horizons, more pairs and another robot."""
    solves: int = 40
    """Converged solves of IPOPT a case."""
    qps: int = 100
    """QPs of every case that DAQP and PIQP solve too; 0 for none."""
    tasks: Names = "reach,pick_place"
    """Tasks that the scripted operator does meanwhile in mode ee, in their own table; or all."""
    robots: Names = "lekiwi,ridgeback_ur10"
    """Robots that do these tasks; or all."""
    json: str = ""
    """Write everything measured to this file."""

    def check(self) -> None:
        """Check the settings."""
        check_whole(self, updates=10, solves=1, seed=0, qps=0)
        check_names("task", "--tasks", names(self.tasks, TASKS), TASKS)
        check_names("robot", "--robots", names(self.robots, ROBOTS), ROBOTS)
        check_json(self.json)
