"""A controller's command to the robot, and its diagnostics."""

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from handrail.controllers.interface.trajectory import Trajectory


class Status(StrEnum):
    """How an update went; with everything but `ok` and `clipped` it comes to rest."""

    OK = "ok"
    CLIPPED = "clipped"  # a direct command that the limits cut
    INVALID_INTENT = "invalid_intent"  # wrong size, NaN or infinite, in an unknown frame, from the future
    INVALID_STATE = "invalid_state"  # the same, or its clock does not advance
    INVALID_SCENE = "invalid_scene"  # two things of one name, or one held by a frame that the robot lacks
    STALE_INTENT = "stale_intent"
    SOLVER_FAILED = "solver_failed"  # the robot follows what it was sent, or stops
    BACKUP = "backup"  # no way out of the plan is certified: the same, or the least bad motion

    @property
    def brakes(self) -> bool:
        """Whether the command of this update leads to rest instead of following a new plan."""
        return self not in (Status.OK, Status.CLIPPED)


@dataclass(frozen=True)
class Diagnostics:
    """How the controller fared in one update."""

    status: Status = Status.OK  # what happened
    solve_time: float = 0.0  # of the whole update [s]
    slack: float = 0.0  # largest violation of a soft limit in the plan, in its own unit
    smallest_distance: float = np.inf  # smallest signed distance now, tool against work surfaces left out [m]
    work_distance: float = np.inf  # smallest signed distance of the tool against work surfaces now [m]


@dataclass(frozen=True)
class Command(Trajectory):
    """A velocity trajectory from now on, linear between its knots, at rest after the last.

    It began before now, `elapsed` > 0, where an earlier plan is being followed.
    """

    grippers: tuple[float, ...] = (0.0,)  # of each hand: 0 open, 1 closed; NaN, as it is, until it is asked
    diagnostics: Diagnostics = field(default_factory=Diagnostics)  # how the controller fared
    plan: Trajectory | None = None
    """The plan beyond its certified part, to be shown; None where it has no plan.
    The robot is not sent it."""
