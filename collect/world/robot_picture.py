"""A picture of a robot: its shapes over its meshes, the pairs that can meet, how far each hand reaches."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from handrail.collect.world import geometry
from handrail.collect.world.gl import mujoco
from handrail.collect.world.rendering import Painter
from handrail.collect.world.robot import build_robot
from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import restated
from handrail.controllers.modelling.pairs import configurations
from handrail.controllers.robot.model import RobotModel, load_model
from handrail.datasets.presentation.drawing import COLOURS, INK, new_figure, png, tidy
from handrail.datasets.storage.atomic import write_whole

_SAMPLES = 2000
_SIZE = 700  # of the drawn robot [px]
_CLEAR = (0.85, 0.35, 0.10, 0.35)  # colour of shapes
_LETTERS = 26  # of a shape's name


def draw_robot(robot: str, path: Path) -> None:
    """Draw a robot, by name or description file, into a .png file."""
    model = load_model(robot)
    figure = new_figure(15.0, 8.5)
    left, middle, right = figure.subfigures(1, 3, width_ratios=(1.05, 1.0, 0.6))
    axes = left.subplots()
    axes.imshow(_painted(model))
    axes.set_axis_off()
    axes.set_title(f"{model.description.name} at home, its shapes over its meshes", color=INK)
    _draw_pairs(middle.subplots(), model)
    _draw_reach(right.subplots(2, 1), model)
    write_whole(path, png(figure))


def _painted(model: RobotModel) -> NDArray[np.uint8]:
    """Return the robot at home, seen from ahead and beside, (height, width, 3)."""
    spec, robot = build_robot(model, grips=False), model.description
    for placed in robot.collision:
        if geom := spec.geom(placed.name):
            geom.group, geom.rgba = geometry.VISIBLE_GROUP, _CLEAR
    q = np.array(robot.home)
    q[: len(robot.base.joints)] = 0.0
    places = np.array([model.pose(q, each.frame).position for each in (*robot.collision, *robot.hands)])
    middle, size = (places.max(axis=0) + places.min(axis=0)) / 2, float(np.ptp(places, axis=0).max())
    away = max(2.2 * size, 1.2 * robot.world.scale) * np.array([0.62, -0.66, 0.42])
    right = np.cross(-away, [0.0, 0.0, 1.0])
    pose = geometry.camera_pose(middle + away, right / np.linalg.norm(right), -away / np.linalg.norm(away))
    spec.worldbody.add_camera(name="picture", fovy=42.0, **pose)
    with restated(f"robot {robot.name}: MuJoCo says", ValueError):
        compiled = spec.compile()
    data = mujoco.MjData(compiled)
    for name, value in zip(model.joints, q, strict=True):
        data.qpos[compiled.joint(name).qposadr[0]] = value
    mujoco.mj_forward(compiled, data)
    return Painter((_SIZE, _SIZE), pretty=True).paint(compiled, data, "picture")


def _draw_pairs(axes: Any, model: RobotModel) -> None:
    names = [placed.name for placed in model.description.collision]
    listed = np.zeros((len(names), len(names)))
    for first, second in model.description.self_pairs:
        i, j = names.index(first), names.index(second)
        listed[max(i, j), min(i, j)] = 1.0
    axes.imshow(np.where(np.tri(len(names), k=-1) > 0, listed, np.nan), cmap="Oranges", vmin=-0.15, vmax=1.3)
    labels = [name if len(name) <= _LETTERS else f"…{name[-_LETTERS + 1 :]}" for name in names]
    axes.set_xticks(range(len(names)), labels, rotation=90)
    axes.set_yticks(range(len(names)), labels)
    axes.set_title(f"{len(model.description.self_pairs)} pairs that can meet")
    tidy(axes, "")
    axes.tick_params(labelsize=6.5)


def _draw_reach(both: Any, model: RobotModel) -> None:
    """Draw where the hands get to, the base standing still, from above and from beside."""
    q = configurations(model, _SAMPLES, np.random.default_rng(0))
    if model.description.self_pairs:
        q = q[CollisionModel(model).values(q).min(axis=1) > 0.0]
    for axes, vertical, word in zip(both, (1, 2), ("from above", "from beside"), strict=True):
        for colour, hand in zip(COLOURS, model.description.hands, strict=False):
            places = _places(model.with_hand(hand.name), q)
            axes.scatter(
                places[:, 0], places[:, vertical], s=2, alpha=0.4, color=colour, label=hand.name or "hand"
            )
        axes.set(xlabel="x [m]", ylabel=f"{'xyz'[vertical]} [m]", aspect="equal")
        axes.set_title(f"reach, {word}")
        tidy(axes)
    both[0].legend(loc="upper left", fontsize=8, frameon=False)


def _places(model: RobotModel, q: FloatArray) -> FloatArray:
    return np.array([model.pose(each).position for each in q]).reshape(-1, 3)
