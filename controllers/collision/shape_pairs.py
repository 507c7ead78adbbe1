"""Which shapes must keep apart: those of the robot, of the scene, and of what the hand holds."""

from collections.abc import Iterable
from functools import lru_cache

import coal
import numpy as np
import pinocchio as pin

from handrail.controllers.arrays import BoolArray, FloatArray, frozen
from handrail.controllers.collision.motion_bounds import motion_bounds
from handrail.controllers.errors import HandrailError
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.parts import PlacedShape, Placement
from handrail.controllers.robot.scene_shapes import floor_shapes, scene_shapes
from handrail.controllers.robot.shape import Obstacle, Shape

FLOOR = "floor"
_WORLD = "universe"  # pinocchio's name of it


class ShapePairs:
    """Robot shapes with each other, floor and obstacles; what the hand holds with robot and obstacles.

    A held thing keeps from the shapes of the robot that the tool's shapes keep from, and from obstacles; not
    from floor and work surfaces, since things are put down on them.

    Args:
        model: of the robot.
        obstacles: what stands around, and what is held.

    Attributes:
        geometry: all shapes and pairs, for coal.
        names: of the two shapes of each pair, (P,) of (str, str).
        work: which pairs are a tool shape against a work surface, (P,).
        largest_margin: the largest margin that a pair can keep [m], (P,).
        rows: those of the pairs with each obstacle, by its name.
        held: rows of the pairs with something that is held, (H,).
        moves: which coordinates move the two shapes of a pair: 1 or 0, (P, 2, n).
        motion_bounds: how far a unit of each coordinate can bring a pair together at most, (n, P) [m].
    """

    def __init__(self, model: RobotModel, obstacles: tuple[Obstacle, ...]) -> None:
        self._model = model
        self.geometry = pin.GeometryModel()
        description = model.description
        placed = (*description.collision, *map(_placed, obstacles))
        _check_names([thing.name for thing in placed])
        self._index = {thing.name: self._add(thing) for thing in placed} | {FLOOR: self._add_floor()}
        tools = {thing.name for thing in description.collision if thing.tool}
        surfaces = {obstacle.name for obstacle in obstacles if obstacle.work_surface}
        others = (*self._scene_pairs(obstacles), *self._held_pairs(obstacles, tools))
        self.names = (*description.self_pairs, *others)
        for first, second in self.names:
            self.geometry.addCollisionPair(pin.CollisionPair(self._index[first], self._index[second]))
        self.work: BoolArray = frozen([a in tools and b in surfaces for a, b in self.names], dtype=bool)
        margins = [description.self_margins, np.full(len(others), np.inf)]
        self.largest_margin: FloatArray = frozen(np.concatenate(margins))
        self.moves = self._pair_moves()
        self.motion_bounds = np.zeros((model.size, len(self.names)))
        self._shape_bounds = dict(_all_motion_bounds(model))
        self.rows = {
            name: [row for row, pair in enumerate(self.names) if name in pair]
            for name in (obstacle.name for obstacle in obstacles)
        }
        held = (row for obstacle in obstacles if obstacle.held for row in self.rows[obstacle.name])
        self.held = np.array(list(held), dtype=int)
        self._seen: dict[str, tuple[bytes, ...]] = {}
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
        return moved

    def place(self, obstacle: Obstacle, time: float = 0.0) -> None:
        """Put an obstacle where it is after a time [s]."""
        centre = obstacle.position + time * obstacle.velocity
        frame = self._model.pinocchio.frames[self._model.frame_id(obstacle.frame or _WORLD)]
        thing = self.geometry.geometryObjects[self._index[obstacle.name]]
        thing.placement = frame.placement * pin.SE3(np.array(obstacle.rotation), centre)

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

    def _add(self, placed: PlacedShape) -> int:
        thing = pin.GeometryObject(placed.name, *self._model.mount(placed), _coal_shape(placed.shape))
        return self.geometry.addGeometryObject(thing)

    def _add_floor(self) -> int:
        below = coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)
        return self.geometry.addGeometryObject(pin.GeometryObject(FLOOR, 0, pin.SE3.Identity(), below))

    def _pair_moves(self) -> FloatArray:
        model = self._model.pinocchio
        moved = np.zeros((model.njoints, model.nv))
        for joint in range(1, model.njoints):
            moved[joint] = moved[model.parents[joint]]
            moved[joint, model.joints[joint].idx_v] = 1.0
        joints = [thing.parentJoint for thing in self.geometry.geometryObjects]
        pairs = [(joints[pair.first], joints[pair.second]) for pair in self.geometry.collisionPairs]
        return moved[np.array(pairs, dtype=int).reshape(-1, 2)]

    def _bound_motions(self, rows: Iterable[int]) -> None:
        """Write the motion bounds of some pairs.

        A coordinate that moves both shapes alike does not bring them together; of one that moves a single
        shape it is the shape's motion bound.
        """
        none = np.zeros(self._model.size)
        for row in rows:
            first, second = (self._shape_bounds.get(name, none) for name in self.names[row])
            self.motion_bounds[:, row] = (self.moves[row, 0] != self.moves[row, 1]) * np.maximum(
                first, second
            )


def _check_names(names: list[str]) -> None:
    """Check that nothing has the name of something else: of a thing, a shape of the robot, the floor."""
    if twice := {name for name in names if names.count(name) > 1 or name == FLOOR}:
        raise HandrailError(
            f"names of obstacles and shapes: expected each once and none {FLOOR!r}, got {sorted(twice)} again"
        )


def _placed(obstacle: Obstacle) -> PlacedShape:
    placement = Placement(obstacle.position, obstacle.rotation)
    return PlacedShape(obstacle.name, obstacle.frame or _WORLD, obstacle.shape, placement)


def _coal_shape(shape: Shape) -> coal.ShapeBase:
    make = {"box": coal.Box, "capsule": coal.Capsule, "sphere": coal.Sphere, "cylinder": coal.Cylinder}
    return make[shape.kind](*(float(length) for length in shape.size))


@lru_cache(maxsize=8)
def _all_motion_bounds(model: RobotModel) -> dict[str, FloatArray]:
    return {shape.name: motion_bounds(model, shape) for shape in model.description.collision}
