"""Hold a drawer open with one hand and take a cube out of it with the other."""

from dataclasses import dataclass, replace

import numpy as np

from handrail.collect.world.observation import pose_names, pose_numbers
from handrail.collect.world.scene import Slide
from handrail.collect.world.task import Aim, Start, TaskState, Verdict
from handrail.collect.world.tasks.catalogue import check_robot
from handrail.collect.world.tasks.drawer import FLOOR, Drawer, handle, opened
from handrail.collect.world.tasks.furniture import cube
from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import RobotModel

_SPRING = 5.0  # that closes the drawer [N]
_EDGE, _MASS = 0.05, 0.1  # of the cube [m, kg]
_TRAVEL = 0.40  # of the drawer, which comes out whole [m]
_SHUT, _OPEN = 0.02, 0.20  # [m]


@dataclass(frozen=True)
class Fetch(Drawer):
    """A `Drawer` that closes by itself when it is let go, with a cube in it.

    Success: the cube above the cabinet, the drawer closed again, the hand that held it open and away.
    Failure: the cube on the floor.
    """

    description: str = "Hold the drawer open with one hand and take the cube out with the other."
    time_limit: float = 90.0  # [s]

    @property
    def state_names(self) -> tuple[str, ...]:
        """Those of `Drawer`, and the cube's pose."""
        return (*super().state_names, *pose_names("cube"))

    def sample(self, model: RobotModel, rng: np.random.Generator) -> Start:
        """Draw the cabinet, the robot's start and the cube, on the side of the hand that takes it."""
        check_robot("fetch", model.description)
        start = super().sample(model, rng)
        body, shut = (start.scene.find(name) for name in ("cabinet", "drawer"))
        tools = [model.pose(start.q, hand.named("tool")).position for hand in model.description.hands]
        side = np.sign((tools[1 - model.number] - tools[model.number]) @ shut.rotation[:, 1])
        depth, yaw = shut.shape.size[0], rng.uniform(-np.pi / 4, np.pi / 4)
        way = [rng.uniform(0.10, 0.14) - depth / 2, side * rng.uniform(0.08, 0.14), FLOOR]
        x, y, bottom = shut.position + shut.rotation @ way
        slide = Slide(np.array([-1.0, 0.0, 0.0]), _TRAVEL, closing=_SPRING)
        thing = cube(x, y, bottom, yaw, _EDGE, _MASS)
        return replace(start, scene=replace(start.scene, objects=(body, replace(shut, slide=slide), thing)))

    def features(self, state: TaskState) -> FloatArray:
        """Return the numbers that `state_names` names, (16,)."""
        return np.append(super().features(state), pose_numbers(state.pose("cube")))

    def aim(self, state: TaskState) -> Aim:
        """Return the handle; the cube, from above, once the drawer is open."""
        return Aim("cube", state.pose("cube").position) if opened(state) > _OPEN else super().aim(state)

    def outcome(self, state: TaskState) -> Verdict:
        """Judge where the cube is, whether the drawer is closed, and whether its hand let go."""
        height = state.pose("cube").position[2]
        if height < 2 * _EDGE:
            return Verdict(failure="dropped")
        out = height > state.object("cabinet").top + _EDGE
        return Verdict(success=bool(out) and opened(state) < _SHUT and state.let_go(handle(state)))
