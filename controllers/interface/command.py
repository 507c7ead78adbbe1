"""What a controller sends to the robot, and how it fared."""

from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property

import numpy as np

from handrail.controllers.arrays import FloatArray, frozen
from handrail.controllers.interface.trajectory import Trajectory


class Status(StrEnum):
    """How an update went; with everything but `ok` and `clipped` it comes to rest."""

    OK = "ok"
    CLIPPED = "clipped"  # a direct command that the limits cut
    INVALID_INTENT = "invalid_intent"  # wrong size, NaN or infinite, in an unknown frame, from the future
    INVALID_STATE = "invalid_state"  # the same, or its clock does not advance
    INVALID_SCENE = "invalid_scene"  # two things of one name, or one held by a frame that the robot lacks
    STALE_INTENT = "stale_intent"
    SOLVER_FAILED = "solver_failed"  # the stored backup is followed
    BACKUP = "backup"  # the plan leaves no safe way out: the stored backup is followed

    @property
    def brakes(self) -> bool:
        """Whether the command of this update leads to rest instead of following a new plan."""
        return self not in (Status.OK, Status.CLIPPED)


@dataclass(frozen=True)
class Diagnostics:
    """How the controller fared in one update.

    Attributes:
        status: what happened.
        solve_time: of the whole update [s].
        slack: largest violation of a soft limit in the plan, in its own unit.
        smallest_distance: smallest signed distance now, tool against work surfaces left out [m].
        work_distance: smallest signed distance of the tool against work surfaces now [m].
        tracking_error: norm of the commanded channels' error at the end of the plan [m/s, rad/s].
        phases: where the update's time went [s].
    """

    status: Status = Status.OK
    solve_time: float = 0.0
    slack: float = 0.0
    smallest_distance: float = np.inf
    work_distance: float = np.inf
    tracking_error: float = 0.0
    phases: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class Command:
    """A velocity trajectory from now on, linear between its knots, at rest after the last.

    Attributes:
        velocities: generalised velocities at times 0, dt, 2 dt, … since the first knot, (k, n) [m/s, rad/s].
        dt: time between knots [s].
        gripper: 0 open, 1 closed.
        diagnostics: how the controller fared.
        elapsed: how long ago the first knot was [s]; zero but where an earlier plan is being followed.
    """

    velocities: FloatArray
    dt: float
    gripper: float = 0.0
    diagnostics: Diagnostics = field(default_factory=Diagnostics)
    elapsed: float = 0.0

    def __post_init__(self) -> None:
        """Copy the array and make it read-only."""
        object.__setattr__(self, "velocities", frozen(self.velocities))

    @cached_property
    def trajectory(self) -> Trajectory:
        """The velocities as a trajectory."""
        return Trajectory(self.velocities, self.dt, self.elapsed)

    def velocity(self, time: float) -> FloatArray:
        """Return the commanded velocity `time` [s] from the update on, (n,)."""
        return self.trajectory.velocity(time)
