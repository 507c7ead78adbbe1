"""Pull a drawer open by its handle."""

from dataclasses import dataclass

import numpy as np

from handrail.collect.world.scene import Scene, Viewpoint
from handrail.collect.world.tasks.cabinet import HANDLE, cabinet, drawer, inward
from handrail.collect.world.tasks.starts import check_large, near_home
from handrail.collect.world.tasks.task import Aim, Start, TaskState, Verdict
from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import RobotModel

_VIEW = Viewpoint(position=(-0.9, -2.7, 1.9), target=(-0.1, 0.1, 0.6), fovy=52.0)
_OPENING = 0.20  # [m]


@dataclass(frozen=True)
class Drawer:
    """A cabinet that is out of reach at first, turned by up to 0.3 rad; the handle is at 0.64 to 0.83 m.

    Success: the drawer open by 0.20 m of its 0.35 m, the gripper let go and away from the handle.
    There is no failure but running out of time.

    Attributes:
        description: what the operator is asked to do.
        horizon: time limit [s].
    """

    description: str = "Pull the drawer open by its handle."
    horizon: float = 60.0

    @property
    def state_names(self) -> tuple[str, ...]:
        """Handle now, direction into the cabinet, how far the drawer is open, the cabinet's top centre."""
        names = [f"handle.{axis}" for axis in "xyz"]
        return (*names, "inward.nx", "inward.ny", "drawer.opening", *(f"cabinet.{axis}" for axis in "xyz"))

    def sample(self, model: RobotModel, rng: np.random.Generator) -> Start:
        """Draw the cabinet, then the robot's start."""
        check_large(model, "Drawer")
        x, y = 0.95 + rng.uniform(-0.1, 0.1), rng.uniform(-0.6, 0.6)
        body = cabinet("cabinet", x, y, rng.uniform(-0.3, 0.3), rng.uniform(0.76, 0.95))
        return Start(Scene((body, drawer("drawer", body)), _VIEW), near_home(model, rng))

    def features(self, state: TaskState) -> FloatArray:
        """Return the numbers that `state_names` names, (9,)."""
        body = state.object("cabinet")
        direction = inward(body.rotation)[:2]
        return np.array([*handle(state), *direction, opened(state), *body.position[:2], body.top])

    def aim(self, state: TaskState) -> Aim:
        """Return the handle, from before the cabinet."""
        into = inward(state.object("cabinet").rotation)
        return Aim("handle", handle(state), handle_rotation(state.tool.rotation, into))

    def outcome(self, state: TaskState) -> Verdict:
        """Judge how far the drawer is open, and whether the hand has let go."""
        return Verdict(success=opened(state) >= _OPENING and state.let_go(handle(state)))


def handle(state: TaskState) -> FloatArray:
    """Return where the middle of the handle is now, (3,) [m]."""
    pose = state.pose("drawer")
    return pose.position + pose.rotation @ HANDLE


def handle_rotation(tool: FloatArray, into: FloatArray) -> FloatArray:
    """Return the rotation nearest to the tool's that points it into the cabinet, fingers above and below."""
    candidates = [
        np.column_stack([up, np.cross(into, up), into]) for up in ([0.0, 0.0, 1.0], [0.0, 0.0, -1.0])
    ]
    return max(candidates, key=lambda rotation: float(np.trace(rotation.T @ tool)))


def opened(state: TaskState) -> float:
    """Return how far the drawer is open [m]."""
    start, now = state.object("drawer"), state.pose("drawer")
    return float(inward(start.rotation) @ (start.position - now.position))
