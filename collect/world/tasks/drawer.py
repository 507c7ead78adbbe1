"""Pull a drawer open by its handle: the cabinet and the task."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from handrail.collect.world.observation import names_of
from handrail.collect.world.scene import Scene, SceneObject, Slide, Viewpoint, box
from handrail.collect.world.task import Aim, Start, Task, TaskState, Verdict
from handrail.collect.world.tasks.catalogue import check_robot
from handrail.collect.world.tasks.furniture import CABINET, SIDES, STEEL, WOOD, block, standing
from handrail.collect.world.tasks.postures import hand_rotation, near_home, nearest_rotation
from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import RobotModel

_DEPTH, _WIDTH, _WALL = 0.45, 0.50, 0.02  # of the cabinet [m]
_TALL, _GAP = 0.20, 0.006  # of the drawer's opening, and the play around the drawer [m]
_BAR, _LENGTH, _STANDOFF = 0.018, 0.16, 0.055  # of the handle, and from the front to its centre [m]
_MASS = 2.5  # of the drawer [kg]
_THIN = 0.012  # its bottom and sides [m]
FLOOR = _THIN + _GAP - _TALL / 2  # of the drawer, in its frame [m]
TRAVEL = 0.35  # of the drawer [m]
DROP = _WALL + _TALL / 2  # of the drawer's middle below the cabinet's top [m]
HANDLE = np.array([-_DEPTH / 2 - _STANDOFF, 0.0, 0.0])  # in the drawer's frame, closed [m]
_VIEW = Viewpoint(position=(-0.9, -2.7, 1.9), target=(-0.1, 0.1, 0.6), fovy=52.0)
_OPENING = 0.20  # [m]


def cabinet(name: str, x: float, y: float, yaw: float, height: float) -> SceneObject:
    """Return the body: its front, to −x of its own frame, has an opening under the top [m, rad]."""
    below, middle = height - _WALL - _TALL, height / 2 - DROP
    parts = (
        block((_DEPTH, _WIDTH, _WALL), [0.0, 0.0, (height - _WALL) / 2]),
        block((_DEPTH, _WIDTH, below), [0.0, 0.0, (below - height) / 2]),
        block((_WALL, _WIDTH - 2 * _WALL, _TALL), [(_DEPTH - _WALL) / 2, 0.0, middle]),
        *(block((_DEPTH, _WALL, _TALL), [0.0, side * ((_WIDTH - _WALL) / 2), middle]) for side in SIDES),
    )
    shape = box([_DEPTH, _WIDTH, height])
    return standing(name, shape, x, y, yaw=yaw, rgba=CABINET, work_surface=True, parts=parts)


def drawer(name: str, body: SceneObject) -> SceneObject:
    """Return the drawer of a cabinet, closed; it opens along −x of its frame."""
    width, tall = _WIDTH - 2 * _WALL - 2 * _GAP, _TALL - 2 * _GAP
    depth, deep = _DEPTH - _WALL - _GAP, 0.6 * tall
    front, thin = -_DEPTH / 2, _THIN
    middle, low = front + depth / 2, (deep - tall) / 2
    parts = [
        block((_WALL, width, tall), [front + _WALL / 2, 0.0, 0.0]),
        block((depth, width, thin), [middle, 0.0, (thin - tall) / 2]),
        block((thin, width, deep), [front + depth - thin / 2, 0.0, low]),
        block((_BAR, _LENGTH, _BAR), HANDLE, STEEL),
    ]
    for side in SIDES:
        parts.append(block((depth, thin, deep), [middle, side * (width - thin) / 2, low]))
        post = [front - _STANDOFF / 2, side * (_LENGTH - _BAR) / 2, 0.0]
        parts.append(block((_STANDOFF, _BAR, _BAR), post, STEEL))
    return SceneObject(
        name,
        box([_DEPTH, width, tall]),
        np.array([*body.position[:2], body.top - DROP]),
        body.rotation,
        rgba=WOOD,
        mass=_MASS,
        parts=tuple(parts),
        slide=Slide(np.array([-1.0, 0.0, 0.0]), TRAVEL),
    )


def inward(rotation: FloatArray) -> FloatArray:
    """Return the direction into the cabinet, in the world, (3,)."""
    return rotation[:, 0]


@dataclass(frozen=True)
class Drawer(Task):
    """A cabinet that is out of reach at first, turned by up to 0.3 rad; the handle is at 0.64 to 0.83 m.

    Success: the drawer open by 0.20 m of its 0.35 m, the gripper let go and away from the handle.
    There is no failure but running out of time.
    """

    description: str = "Pull the drawer open by its handle."
    time_limit: float = 60.0  # [s]
    parts: ClassVar[Mapping[str, str]] = {"handle": "drawer"}

    @property
    def state_names(self) -> tuple[str, ...]:
        """Handle now, direction into the cabinet, how far the drawer is open, the cabinet's top centre."""
        return (*names_of("handle"), "inward.nx", "inward.ny", "drawer.opening", *names_of("cabinet"))

    def sample(self, model: RobotModel, rng: np.random.Generator) -> Start:
        """Draw the cabinet, then the robot's start."""
        check_robot("drawer", model.description)
        x, y = 0.95 + rng.uniform(-0.1, 0.1), rng.uniform(-0.6, 0.6)
        body = cabinet("cabinet", x, y, rng.uniform(-0.3, 0.3), rng.uniform(0.76, 0.95))
        return Start(Scene((body, drawer("drawer", body)), _VIEW), near_home(model, rng))

    def features(self, state: TaskState) -> FloatArray:
        """Return the numbers that `state_names` names, (9,)."""
        body = state.object("cabinet")
        return np.array([*handle(state), *inward(body.rotation)[:2], opened(state), *body.top_centre])

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
    return nearest_rotation(tool, (hand_rotation([0.0, 0.0, up], into) for up in (1.0, -1.0)))


def opened(state: TaskState) -> float:
    """Return how far the drawer is open [m]."""
    start, now = state.object("drawer"), state.pose("drawer")
    return float(inward(start.rotation) @ (start.position - now.position))
