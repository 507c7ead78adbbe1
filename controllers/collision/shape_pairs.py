"""Which shapes must keep apart: those of the robot, of the scene, and of what the hand holds."""

from collections.abc import Iterable
from functools import lru_cache
from typing import Any

import coal
import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray, frozen
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.description import check_once
from handrail.controllers.robot.model import RobotModel, joint_memory, joints_of
from handrail.controllers.robot.parts import PlacedShape, Placement
from handrail.controllers.robot.scene_shapes import floor_shapes, scene_shapes
from handrail.controllers.robot.shape import Obstacle, Shape

FLOOR = "floor"
_WORLD = "universe"  # pinocchio's name of it
_KINDS = ("sphere", "capsule", "box", "cylinder", FLOOR)  # in the order of shapes.h


class ShapePairs:
    """Robot shapes with each other, floor and obstacles; what the hand holds with robot and obstacles.

    A held thing keeps from the shapes of the robot that the tool's shapes keep from, and from obstacles; not
    from floor and work surfaces, since things are put down on them.

    Args:
        model: of the robot.
        obstacles: what stands around, and what is held.

    Attributes:
        names: of the two shapes of each pair, (P,) of (str, str).
        work: which pairs are a tool shape against a work surface, (P,).
        largest_margin: the largest margin that a pair can keep [m], (P,).
        rows: those of the pairs with each obstacle, by its name.
        held: rows of the pairs with something that is held, (H,).
        memory: the compiled core's `Scene`.
    """

    def __init__(self, model: RobotModel, obstacles: tuple[Obstacle, ...]) -> None:
        self._model = model
        description = model.description
        self._placed = [*description.collision, *map(_placed, obstacles)]
        check_once([*(thing.name for thing in self._placed), FLOOR], "names of obstacles and shapes")
        self._index = {thing.name: index for index, thing in enumerate(self._placed)}
        self._index[FLOOR] = len(self._placed)
        tools = {thing.name for thing in description.collision if thing.tool}
        surfaces = {obstacle.name for obstacle in obstacles if obstacle.work_surface}
        others = (*self._scene_pairs(obstacles), *self._held_pairs(obstacles, tools))
        self.names = (*description.self_pairs, *others)
        self.work: BoolArray = frozen([a in tools and b in surfaces for a, b in self.names], dtype=bool)
        margins = [description.self_margins, np.full(len(others), np.inf)]
        self.largest_margin: FloatArray = frozen(np.concatenate(margins))
        self.rows = {
            name: [row for row, pair in enumerate(self.names) if name in pair]
            for name in (obstacle.name for obstacle in obstacles)
        }
        held = (row for obstacle in obstacles if obstacle.held for row in self.rows[obstacle.name])
        self.held = np.array(list(held), dtype=int)
        self.memory = joint_memory(model, len(self._index), len(self.names))
        self._take_shapes()
        self._take_pairs()
        self.memory.call_back("measure", self._measure)
        self.failure: BaseException | None = None
        self._shape_bounds = dict(_motion_bounds_of(model))
        self._seen: dict[str, tuple[bytes, ...]] = {}
        self._speeds = np.zeros(len(self._index))  # of each shape in the world [m/s]
        self._bound_motions(range(len(self.names)))
        self.update_scene(obstacles)

    def update_scene(self, obstacles: tuple[Obstacle, ...]) -> list[Obstacle]:
        """Put every obstacle where it is now; return those that have moved, or move.

        A thing may have slipped in the hand, and reach farther.
        """
        moved = []
        for obstacle in obstacles:
            now = tuple(each.tobytes() for each in (obstacle.position, obstacle.rotation, obstacle.velocity))
            if now == self._seen.get(obstacle.name) and not obstacle.velocity.any():
                continue
            self._seen[obstacle.name] = now
            moved.append(obstacle)
            self.place(obstacle)
            if obstacle.held:
                self._shape_bounds[obstacle.name] = motion_bounds(self._model, _placed(obstacle))
                self._bound_motions(self.rows[obstacle.name])
        self.memory.fields.changes += bool(moved)
        return moved

    def place(self, obstacle: Obstacle) -> None:
        """Put an obstacle where it is now."""
        frame = self._model.pinocchio.frames[self._model.frame_id(obstacle.frame or _WORLD)].placement
        index, memory = self._index[obstacle.name], self.memory
        memory.shape_rotation[index] = (frame.rotation @ obstacle.rotation).ravel()
        memory.shape_position[index] = frame.act(np.array(obstacle.position))
        memory.velocity[index] = frame.rotation @ obstacle.velocity
        self._speeds[index] = np.linalg.norm(obstacle.velocity)
        rows = self.rows[obstacle.name]
        memory.speed[rows] = self._speeds[memory.first[rows]] + self._speeds[memory.second[rows]]

    def _scene_pairs(self, obstacles: tuple[Obstacle, ...]) -> list[tuple[str, str]]:
        """Return the robot with the floor and with what stands around."""
        around = [obstacle.name for obstacle in obstacles if not obstacle.held]
        return [
            *((name, FLOOR) for name in floor_shapes(self._model)),
            *((name, other) for name in scene_shapes(self._model) for other in around),
        ]

    def _held_pairs(self, obstacles: tuple[Obstacle, ...], tools: set[str]) -> list[tuple[str, str]]:
        """Return robot and obstacles with what is held."""
        of_tools = [pair for pair in self._model.description.self_pairs if tools.intersection(pair)]
        own = dict.fromkeys(name for pair in of_tools for name in pair if name not in tools)
        around = [each.name for each in obstacles if not (each.held or each.work_surface)]
        held = [obstacle.name for obstacle in obstacles if obstacle.held]
        return [
            *((name, thing) for thing in held for name in own),
            *((thing, other) for thing in held for other in around),
        ]

    def _take_shapes(self) -> None:
        memory = self.memory
        for index, thing in enumerate(self._placed):
            memory.carrier[index], placement = self._model.mount(thing)
            memory.shape_rotation[index] = placement.rotation.ravel()
            memory.shape_position[index] = placement.translation
            memory.kind[index], memory.size[index] = _KINDS.index(thing.shape.kind), _size(thing.shape)
        memory.kind[-1], memory.shape_rotation[-1] = _KINDS.index(FLOOR), np.eye(3).ravel()

    def _take_pairs(self) -> None:
        model, memory = self._model.pinocchio, self.memory
        moved = np.zeros((model.njoints, model.nv))
        for joint in range(1, model.njoints):
            moved[joint] = moved[model.parents[joint]]
            moved[joint, model.joints[joint].idx_v] = 1.0
        for row, (first, second) in enumerate(self.names):
            memory.first[row], memory.second[row] = self._index[first], self._index[second]
        memory.moves[:] = moved[memory.carrier[memory.second]] - moved[memory.carrier[memory.first]]

    def _measure(self, pair: int, placements: Any, witness: Any) -> int:
        """Let coal measure two shapes whose cores meet; write normal and nearest points, (9,)."""
        try:
            given = np.ctypeslib.as_array(placements, (2, 12))
            poses = [coal.Transform3s(each[:9].reshape(3, 3).copy(), each[9:].copy()) for each in given]
            first, second = (coal_shape(self._placed[self._index[name]].shape) for name in self.names[pair])
            found = coal.DistanceResult()
            coal.distance(first, poses[0], second, poses[1], coal.DistanceRequest(), found)
            normal, points = found.normal, (found.getNearestPoint1(), found.getNearestPoint2())
            if np.linalg.norm(normal) < 0.5:  # coal knows none on an axis; any across it leads out
                normal = poses[isinstance(first, coal.Sphere)].getRotation()[:, 0]
                points = poses[0].getTranslation() + np.outer([0.0, found.min_distance], normal)
            said = np.ctypeslib.as_array(witness, (9,))
            said[:] = np.concatenate([normal, *points])
            if not np.isfinite(said).all():
                names = " and ".join(self.names[pair])
                raise HandrailError(f"distance of {names}: expected numbers, got NaN")
        except BaseException as error:  # C cannot pass it on
            self.failure = error
            return 1
        return 0

    def _bound_motions(self, rows: Iterable[int]) -> None:
        """Write the motion bounds of some pairs.

        A coordinate that moves both shapes alike does not bring them together; of one that moves a single
        shape it is the shape's motion bound.
        """
        none, memory = np.zeros(self._model.size), self.memory
        for row in rows:
            first, second = (self._shape_bounds.get(name, none) for name in self.names[row])
            memory.bounds[:, row] = (memory.moves[row] != 0.0) * np.maximum(first, second)


def _placed(obstacle: Obstacle) -> PlacedShape:
    placement = Placement(obstacle.position, obstacle.rotation)
    return PlacedShape(obstacle.name, obstacle.frame or _WORLD, obstacle.shape, placement)


def coal_shape(shape: Shape) -> coal.ShapeBase:
    """Return a shape as coal has it."""
    make = {"box": coal.Box, "capsule": coal.Capsule, "sphere": coal.Sphere, "cylinder": coal.Cylinder}
    return make[shape.kind](*(float(length) for length in shape.size))


def _size(shape: Shape) -> FloatArray:
    """Return a shape's size as shapes.h has it, (3,)."""
    if shape.kind == "box":
        return 0.5 * shape.size
    radius, *length = shape.size
    return np.array([radius, 0.5 * length[0] if length else 0.0, 0.0])


@lru_cache(maxsize=8)
def _motion_bounds_of(model: RobotModel) -> dict[str, FloatArray]:
    return {shape.name: motion_bounds(model, shape) for shape in model.description.collision}


def motion_bounds(model: RobotModel, placed: PlacedShape) -> FloatArray:
    """Return bounds on how far a point of a shape moves per unit of each coordinate, (n,) [m].

    1 for a prismatic joint, 0 for one that does not move it; for a revolute one the largest distance to its
    axis. The shape lies in a ball; so does, seen from the joint's parent, all that a joint makes of a ball:
    one that turns leaves of its centre what lies along the axis, and reaches as far as it was aside.
    """
    joints, limits, bounds = joints_of(model), model.description.limits, np.zeros(model.size)
    farthest = np.maximum(np.abs(limits.position_lower), np.abs(limits.position_upper))
    number, placement = model.mount(placed)
    centre, radius = placement.translation, _radius(placed.shape)
    while number > 0:
        joint = joints[number - 1]
        if joint.prismatic:
            radius += float(farthest[number - 1])
            bounds[number - 1] = 1.0
        else:
            along = (joint.axis @ centre) * joint.axis
            radius += float(np.linalg.norm(centre - along))
            centre, bounds[number - 1] = along, radius
        centre = joint.translation + joint.rotation @ centre
        number = joint.parent
    return bounds


def _radius(shape: Shape) -> float:
    """Return how far from its centre a shape reaches [m]."""
    if shape.kind == "box":
        return 0.5 * float(np.linalg.norm(shape.size))
    radius, half = shape.size[0], 0.5 * shape.size[1:].sum()
    return float(np.hypot(radius, half) if shape.kind == "cylinder" else radius + half)
