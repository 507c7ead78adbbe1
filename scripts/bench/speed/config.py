"""Settings of the bench `speed`; light to import."""

from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from handrail.collect.flags import check_names, names
from handrail.collect.world.tasks.catalogue import TASKS
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.catalogue import ROBOTS
from handrail.controllers.typed import AtLeastOne, Count
from handrail.datasets.lists import Names, Numbers
from handrail.scripts.bench.report import ReportConfig

DEGREES = (8, 9, 10, 13, 18, 20)
PEERS = ("ipopt", "mink", "pink", "own_qp", "daqp", "piqp")


@dataclass(frozen=True)
class SpeedConfig(ReportConfig):
    """Measure the controller's update over degrees of freedom, pairs and stages, beside other solvers.

    What the file of `--json` has already is not measured again.
    """

    degrees: Numbers = (9, 13, 18, 20)
    """Degrees of freedom: 8, 9, 10, 13, 18, 20."""
    pairs: Numbers = (0, 40, 120, 250, 400)
    """Collision pairs; as near to each as whole obstacles allow."""
    horizons: Numbers = (10, 20, 40)
    """Stages."""
    updates: Annotated[int, Meta(ge=10)] = 400
    """Timed updates of every case."""
    peers: Names = "all"
    """Solvers beside it, or all that are installed: ipopt, mink, pink, own_qp, daqp, piqp; empty for none."""
    solves: AtLeastOne = 40
    """Updates of a case whose problem the peers solve too."""
    tasks: Names = "reach,pick_place"
    """Tasks that the scripted operator does meanwhile in mode ee, in their own table; or all."""
    robots: Names = "lekiwi,ridgeback_ur10"
    """Robots that do these tasks; or all; empty for none."""
    seed: Count = 0
    """Of scenes and intents."""

    @property
    def peer_names(self) -> tuple[str, ...]:
        """The peers asked for."""
        return names(self.peers, PEERS)

    def check(self) -> None:
        """Check the settings."""
        super().check()
        if not {*self.degrees} <= {*DEGREES}:
            raise HandrailError(f"--degrees {self.degrees}: expected some of {DEGREES}")
        if min(self.horizons, default=1) < 1 or min(self.pairs, default=0) < 0:
            raise HandrailError("--horizons and --pairs: expected whole numbers from 1, and from 0")
        if self.peers:
            check_names("peer", "--peers", self.peer_names, PEERS)
        if self.robots:
            check_names("task", "--tasks", names(self.tasks, TASKS), TASKS)
            check_names("robot", "--robots", names(self.robots, ROBOTS), ROBOTS)
