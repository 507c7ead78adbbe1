"""Pull a drawer open by its handle: the cabinet and the task."""

from dataclasses import dataclass

import numpy as np

from handrail.collect.world.scene import Colour, Part, Scene, SceneObject, Slide, Viewpoint, box
from handrail.collect.world.task import Aim, Start, TaskState, Verdict, check_large, near_home
from handrail.controllers.arrays import FloatArray
from handrail.controllers.numerics.rotation import matrix_from_rpy
from handrail.controllers.robot.model import RobotModel

_BODY: Colour = (0.87, 0.86, 0.83, 1.0)
_FRONT: Colour = (0.72, 0.56, 0.40, 1.0)
_STEEL: Colour = (0.45, 0.47, 0.50, 1.0)
_DEPTH, _WIDTH, _WALL = 0.45, 0.50, 0.02  # of the cabinet [m]
_TALL, _GAP = 0.20, 0.006  # of the drawer's opening, and the play around the drawer [m]
_BAR, _LENGTH, _STANDOFF = 0.018, 0.16, 0.055  # of the handle, and from the front to its centre [m]
_MASS = 2.5  # of the drawer [kg]
TRAVEL = 0.35  # of the drawer [m]
DROP = _WALL + _TALL / 2  # of the drawer's middle below the cabinet's top [m]
HANDLE = np.array([-_DEPTH / 2 - _STANDOFF, 0.0, 0.0])  # in the drawer's frame, closed [m]
_VIEW = Viewpoint(position=(-0.9, -2.7, 1.9), target=(-0.1, 0.1, 0.6), fovy=52.0)
_OPENING = 0.20  # [m]


def cabinet(name: str, x: float, y: float, yaw: float, height: float) -> SceneObject:
    """Return the body: its front, to −x of its own frame, has an opening under the top [m, rad]."""
    inner, below = _WIDTH - 2 * _WALL, height - _WALL - _TALL
    side = (_WIDTH - _WALL) / 2
    parts = [
        Part(box([_DEPTH, _WIDTH, _WALL]), np.array([0.0, 0.0, (height - _WALL) / 2])),
        Part(box([_DEPTH, _WIDTH, below]), np.array([0.0, 0.0, (below - height) / 2])),
        Part(box([_WALL, inner, _TALL]), np.array([(_DEPTH - _WALL) / 2, 0.0, height / 2 - DROP])),
    ]
    parts += [
        Part(box([_DEPTH, _WALL, _TALL]), np.array([0.0, sign * side, height / 2 - DROP]))
        for sign in (-1.0, 1.0)
    ]
    return SceneObject(
        name,
        box([_DEPTH, _WIDTH, height]),
        np.array([x, y, height / 2]),
        matrix_from_rpy([0.0, 0.0, yaw]),
        rgba=_BODY,
        work_surface=True,
        parts=tuple(parts),
    )


def drawer(name: str, body: SceneObject) -> SceneObject:
    """Return the drawer of a cabinet, closed; it opens along −x of its frame."""
    width, tall = _WIDTH - 2 * _WALL - 2 * _GAP, _TALL - 2 * _GAP
    depth, deep = _DEPTH - _WALL - _GAP, 0.6 * tall
    front, thin = -_DEPTH / 2, 0.012
    middle = front + depth / 2
    parts = [
        Part(box([_WALL, width, tall]), np.array([front + _WALL / 2, 0.0, 0.0])),
        Part(box([depth, width, thin]), np.array([middle, 0.0, (thin - tall) / 2])),
        Part(box([thin, width, deep]), np.array([front + depth - thin / 2, 0.0, (deep - tall) / 2])),
        Part(box([_BAR, _LENGTH, _BAR]), HANDLE, rgba=_STEEL),
    ]
    for sign in (-1.0, 1.0):
        parts.append(
            Part(box([depth, thin, deep]), np.array([middle, sign * (width - thin) / 2, (deep - tall) / 2]))
        )
        post = np.array([front - _STANDOFF / 2, sign * (_LENGTH - _BAR) / 2, 0.0])
        parts.append(Part(box([_STANDOFF, _BAR, _BAR]), post, rgba=_STEEL))
    return SceneObject(
        name,
        box([_DEPTH, width, tall]),
        np.array([*body.position[:2], body.top - DROP]),
        body.rotation,
        rgba=_FRONT,
        mass=_MASS,
        parts=tuple(parts),
        slide=Slide(np.array([-1.0, 0.0, 0.0]), TRAVEL),
    )


def inward(rotation: FloatArray) -> FloatArray:
    """Return the direction into the cabinet, in the world, (3,)."""
    return rotation[:, 0]


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
