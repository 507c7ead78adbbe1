"""Lift a box by its two handles, carry it to another table with both hands, and put it down."""

from dataclasses import dataclass

import numpy as np

from handrail.collect.world.observation import names_of, pose_names, pose_numbers
from handrail.collect.world.scene import Scene, Viewpoint
from handrail.collect.world.task import Aim, Start, Task, TaskState, Verdict
from handrail.collect.world.tasks.catalogue import check_robot
from handrail.collect.world.tasks.furniture import BAR, BAR_LENGTH, crate, table
from handrail.collect.world.tasks.obstacles import obstacle_features, obstacle_names, sample_obstacles
from handrail.collect.world.tasks.postures import hand_rotation, side_by_side
from handrail.controllers.arrays import FloatArray
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import Pose, RobotModel

SIZE = (0.28, 0.28, 0.16)  # of the box without its handles [m]
_MASS = 1.5  # [kg]
_LIFTED = 0.03  # [m]
_AHEAD, _HIGH = 0.68, 1.0  # of the hands at the beginning, from the base and the floor [m]
_VIEW = Viewpoint(position=(3.0, 0.0, 3.5), target=(0.05, 0.0, 0.2), fovy=56.0)
APART = SIZE[1] + 1.1 * BAR_LENGTH  # between the hands when they hold it [m]
GRASP = np.array([0.0, 0.0, (SIZE[2] - BAR) / 2])  # half-way between the handles, in the box's frame [m]


@dataclass(frozen=True)
class CarryBox(Task):
    """The tables are 2.7 m apart; the hands begin as far apart as the box's handles, pointing down.

    Success: the box at rest on the other table, both grippers open and away from it.
    Failure: the box on the floor, or tipped over.
    """

    description: str = "Carry the box to the other table with both hands."
    time_limit: float = 90.0  # [s]

    @property
    def state_names(self) -> tuple[str, ...]:
        """Box pose, the tables' top centres, obstacles (absent ones are all zero)."""
        return (*pose_names("box"), *names_of("box_table"), *names_of("table"), *obstacle_names())

    def sample(self, model: RobotModel, rng: np.random.Generator) -> Start:
        """Draw tables, box, obstacles and the robot's start."""
        check_robot("carry_box", model.description)
        side = rng.choice([-1.0, 1.0])
        tables = [
            table(name, 1.05 + rng.uniform(-0.05, 0.05), way * 1.35, (0.6, 0.8, rng.uniform(0.55, 0.70)))
            for name, way in (("box_table", side), ("table", -side))
        ]
        on, yaw = tables[0], rng.uniform(-0.15, 0.15)
        x, y = on.front + rng.uniform(0.16, 0.20), on.position[1] + rng.uniform(-0.1, 0.1)
        thing = crate("box", x, y, on.top, yaw, SIZE, _MASS)
        q = _sample_start(model, rng)
        return Start(Scene((*tables, thing, *sample_obstacles(model, q, rng)), _VIEW), q)

    def features(self, state: TaskState) -> FloatArray:
        """Return the numbers that `state_names` names, (25,)."""
        tops = [state.object(name).top_centre for name in ("box_table", "table")]
        return np.concatenate([pose_numbers(state.pose("box")), *tops, obstacle_features(state.start.scene)])

    def aim(self, state: TaskState) -> Aim:
        """Return the box, or the table once that is lifted: half-way between where the hands belong."""
        now = state.pose("box")
        if now.position[2] > state.object("box").position[2] + _LIFTED:
            return Aim("table", state.object("table").top_centre + [0.0, 0.0, SIZE[2] / 2] + GRASP)
        return Aim("box", now.position + now.rotation @ GRASP)

    def outcome(self, state: TaskState) -> Verdict:
        """Judge where the box is, whether it rests, and where both hands are."""
        now, goal = state.pose("box"), state.object("table")
        if now.position[2] < 0.4 or now.rotation[2, 2] < np.cos(0.8):
            return Verdict(failure="dropped")
        inside = np.abs(now.position[:2] - goal.position[:2]) < goal.shape.size[:2] / 2
        down = now.position[2] < goal.top + SIZE[2] / 2 + 0.02 and "box" in state.still and inside.all()
        return Verdict(success=bool(down) and state.left_alone(now, GRASP, APART))


def _sample_start(model: RobotModel, rng: np.random.Generator) -> FloatArray:
    """Return a start with the hands ahead of the base, pointing down, as far apart as the handles."""
    q = np.array(model.description.home)
    if model.description.base.joints:
        q[:3] += rng.uniform([-0.10, -0.15, -0.15], [0.10, 0.15, 0.15])
    base = model.pose(q, "planar_base")
    ahead = base.rotation[:, 0]
    middle = base.position + _AHEAD * ahead + [0.0, 0.0, _HIGH]
    q, error = side_by_side(model, q, Pose(middle, hand_rotation(ahead, [0.0, 0.0, -1.0])), APART)
    if error > 1e-3:
        raise HandrailError(
            f"task CarryBox: expected a robot whose hands point down {APART:.2f} m apart, "
            f"{_AHEAD} m ahead and {_HIGH} m high, got {model.description.name}"
        )
    return q
