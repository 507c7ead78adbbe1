"""Carry an open tray with a loose can on it past obstacles on the floor, and put it down on a table."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from handrail.collect.world.observation import names_of, pose_names, pose_numbers
from handrail.collect.world.scene import Scene, SceneObject, Viewpoint
from handrail.collect.world.task import Aim, Start, Task, TaskState, Verdict
from handrail.collect.world.tasks.catalogue import check_robot
from handrail.collect.world.tasks.furniture import BAR, can, table, tray
from handrail.collect.world.tasks.obstacles import obstacle_features, obstacle_names, sample_obstacles
from handrail.collect.world.tasks.postures import hand_rotation, reach_share, side_by_side
from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.channels import Channels
from handrail.controllers.objectives.objective import Objective
from handrail.controllers.objectives.tray import tray_levelling
from handrail.controllers.robot.inverse_kinematics import arm_configuration
from handrail.controllers.robot.model import Pose, RobotModel

_HIGH = 0.20  # of the handle above the plate [m]
_SIZES = (0.26, 0.32, _HIGH), (0.26, 0.56, _HIGH)  # of a tray for a hand, for two: length, width, handle [m]
_TABLES = 0.7, 0.9  # width of the table for either [m]
_TRAY_MASS, _CAN_MASS = 0.35, 0.20  # [kg]
_RADIUS, _HEIGHT = 0.033, 0.10  # of the can [m]
_MOST_TRIES = 20  # starts drawn, until the arm can hold the tray there
_VIEW = Viewpoint(position=(2.2, 0.0, 2.9), target=(-0.2, 0.0, 0.3), fovy=62.0)
_LEVEL = 20.0  # weight of its tilt
_FREE = 0.05  # between a tray and the arm of an idle hand [m]
APART = 0.40  # between two hands that hold it [m]
HANDLE = np.array([0.0, 0.0, _HIGH])  # centre of the handle's bar in the tray's frame [m]


@dataclass(frozen=True)
class Tray(Task):
    """The robot starts with the tray's handle in its gripper; nothing fastens the can.

    Success: the tray at rest on the table, the can standing on it, the gripper open and away.
    Failure: the can fell off or over; the tray dropped.
    """

    description: str = "Carry the tray to the table and put it down without spilling the can."
    time_limit: float = 90.0  # [s]
    hands: int = 1  # that hold it

    @property
    def state_names(self) -> tuple[str, ...]:
        """Tray pose, can pose, the table's top centre, obstacles (absent ones are all zero)."""
        return (*pose_names("tray"), *pose_names("can"), *names_of("table"), *obstacle_names())

    def sample(self, model: RobotModel, rng: np.random.Generator) -> Start:
        """Draw the table, the robot's start with the tray in hand, the can on it, and obstacles."""
        check_robot("wide_tray" if self.hands > 1 else "tray", model.description)
        side = rng.choice([-1.0, 1.0])
        x, y = 1.05 + rng.uniform(-0.05, 0.05), side * 1.30 + rng.uniform(-0.10, 0.10)
        goal = table("table", x, y, (0.6, _TABLES[self.hands - 1], rng.uniform(0.55, 0.65)))
        q, held = _sample_start(model, side, rng, self.hands)
        objects = (goal, held, _sample_can(held, rng), *sample_obstacles(model, q, rng))
        return Start(Scene(objects, _VIEW), q, grip=(BAR,) * self.hands)

    def features(self, state: TaskState) -> FloatArray:
        """Return the numbers that `state_names` names, (29,)."""
        poses = (pose_numbers(state.pose(name)) for name in ("tray", "can"))
        scene = state.start.scene
        return np.concatenate([*poses, scene.find("table").top_centre, obstacle_features(scene)])

    def aim(self, state: TaskState) -> Aim:
        """Return where the hand is when the tray stands in the middle of the table."""
        return Aim("table", state.object("table").top_centre + HANDLE)

    def outcome(self, state: TaskState) -> Verdict:
        """Judge the tray, then the can on it, then whether the tray was left on the table."""
        held, goal = state.pose("tray"), state.object("table")
        if held.position[2] < goal.top - 0.05 or held.rotation[2, 2] < np.cos(0.8):
            return Verdict(failure="tray_dropped")
        if not self._stands_on(held, state.pose("can")):
            return Verdict(failure="can_fell")
        inside = np.abs(held.position[:2] - goal.position[:2]) < goal.shape.size[:2] / 2
        down = held.position[2] < goal.top + 0.02 and "tray" in state.still and inside.all()
        if self.hands > 1:
            return Verdict(success=bool(down) and state.left_alone(held, HANDLE, APART))
        return Verdict(success=bool(down) and state.let_go(held.position + held.rotation @ HANDLE))

    def _stands_on(self, held: Pose, thing: Pose) -> bool:
        """Return whether the can stands upright on the tray."""
        local = held.rotation.T @ (thing.position - held.position)
        size = np.array(_SIZES[self.hands - 1][:2])
        inside = np.all(np.abs(local[:2]) < size / 2) and 0.0 < local[2] < _HEIGHT
        return bool(inside) and float(held.rotation[:, 2] @ thing.rotation[:, 2]) > np.cos(0.8)


WideTray = partial(Tray, hands=2)


def _sample_start(
    model: RobotModel, side: float, rng: np.random.Generator, hands: int
) -> tuple[FloatArray, SceneObject]:
    """Return a start on the far side, hands pointing down ahead of the base, and the tray below them."""
    place = np.zeros(3)
    for _ in range(_MOST_TRIES):
        q, hand = _draw_start(model, side, rng, hands)
        for _ in range(1 + (len(model.description.hands) > hands)):  # beside an idle hand it converges slowly
            q, error = side_by_side(model, q, hand, APART) if hands > 1 else arm_configuration(model, q, hand)
        tool = hand if hands > 1 else model.pose(q)
        level = tool.rotation @ np.diag([1.0, -1.0, -1.0])  # the bar along the y of a hand that points down
        held = tray("tray", tool.position, level, _SIZES[hands - 1], _TRAY_MASS * hands)
        if error <= 1e-3 and _clears_idle_hands(model, q, held, hands):
            return q, held
        place = hand.position
    raise HandrailError(
        f"task Tray: expected a robot that reaches places such as {place.round(2).tolist()} from above, "
        f"clear of idle hands, got {model.description.name}"
    )


def _clears_idle_hands(model: RobotModel, q: FloatArray, held: SceneObject, hands: int) -> bool:
    """Return whether the tray is 5 cm from the arms of hands that do not hold it."""
    if len(model.description.hands) == hands:
        return True
    thing = held.carried(model.pose(q), Pose(held.position, held.rotation), model.hand.named("tool"))
    collision = CollisionModel(model, (thing,))
    return bool(np.min(collision.values(q[None])[0, collision.held]) >= _FREE)


def _draw_start(
    model: RobotModel, side: float, rng: np.random.Generator, hands: int
) -> tuple[FloatArray, Pose]:
    """Return where the base starts, and the hand's pose there: nearer its own side if another is idle."""
    q, ahead = np.array(model.description.home), np.eye(3)[0]
    if model.description.base.joints:
        q[:3] += rng.uniform([-0.10, -0.15, -0.15], [0.10, 0.15, 0.15])
        q[1] -= 0.5 * side
        ahead = np.array([np.cos(q[2]), np.sin(q[2]), 0.0])
    base = model.pose(q, "planar_base").position
    away = rng.uniform(1.05, 1.20) * reach_share(model)
    place = base + away * ahead + np.array([0.0, 0.0, rng.uniform(0.90, 1.00)])
    if len(model.description.hands) > hands:
        across = np.array([-ahead[1], ahead[0], 0.0])
        tools = [model.pose(q, each.named("tool")).position for each in model.description.hands]
        place += 0.5 * across * ((tools[model.number] - np.mean(tools, axis=0)) @ across)
    return q, Pose(place, hand_rotation(ahead, [0.0, 0.0, -1.0]))


def _sample_can(on: SceneObject, rng: np.random.Generator) -> SceneObject:
    offset = np.array([*rng.uniform([-0.05, -0.07], [0.05, 0.07]), _HEIGHT / 2])
    return can("can", on.position + on.rotation @ offset, _RADIUS, _HEIGHT, _CAN_MASS)


def level_tray(channels: Channels, hand: int) -> tuple[Objective, ...]:
    """Return what the masked MPC minds while the operator carries the tray: that it is level."""
    return _levelling(channels, hand)


def level_wide_tray(channels: Channels, hand: int) -> tuple[Objective, ...]:
    """Return the same for a tray that two hands carry, whichever means the task."""
    return _levelling(channels, 0, 1)


def _levelling(channels: Channels, *hands: int) -> tuple[Objective, ...]:
    return (tray_levelling(channels, up=np.array([0.0, 0.0, -1.0]), level=_LEVEL, hands=hands),)
