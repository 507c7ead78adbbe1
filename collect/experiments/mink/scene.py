"""The controller's own shapes as a MuJoCo model, for mink: same pairs, same margins."""

from dataclasses import replace
from typing import Any

from handrail.controllers.errors import not_installed
from handrail.controllers.robot.model import RobotModel
from handrail.controllers.robot.scene_shapes import floor_shapes, scene_shapes
from handrail.controllers.robot.shape import Obstacle

_SOLVERS = ("daqp", "proxqp", "quadprog")  # PIQP is slower than these and prints


def import_mink() -> Any:
    """Return the module mink, which an extra brings.

    Raises:
        HandrailError: it is not installed.
    """
    try:
        import mink
    except ImportError as error:
        raise not_installed("differential IK", "mink", "profile") from error
    return mink


def qp_solvers() -> tuple[str, ...]:
    """Return the QP solvers that mink finds, the ones that are fast and quiet, the fastest first."""
    import qpsolvers

    return tuple(name for name in _SOLVERS if name in qpsolvers.available_solvers)


def shape_model(model: RobotModel, obstacles: tuple[Obstacle, ...]) -> Any:
    """Return the controller's own shapes in MuJoCo, each a geom of its name."""
    from handrail.collect.simulation import geometry
    from handrail.collect.simulation.gl import mujoco
    from handrail.collect.simulation.robot import build_robot

    bare = RobotModel(replace(model.description, gripper=None))
    spec = build_robot(bare, meshes=False).spec
    spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[8.0, 8.0, 0.1])
    for obstacle in obstacles:
        spec.worldbody.add_geom(
            name=obstacle.name,
            **geometry.geom_shape(obstacle.shape),
            **geometry.pose(obstacle.position, obstacle.rotation),
        )
    return spec.compile()


def standing_pairs(model: RobotModel, obstacles: tuple[Obstacle, ...]) -> tuple[tuple[str, str], ...]:
    """Return the pairs that keep apart, the same as the controllers' while nothing is held."""
    return (
        *model.description.self_pairs,
        *((name, "floor") for name in floor_shapes(model)),
        *((name, obstacle.name) for name in scene_shapes(model) for obstacle in obstacles),
    )


def avoidance(
    shapes: Any, pairs: tuple[tuple[str, str], ...], margin: float, reach: float, gain: float = 0.85
) -> Any:
    """Return mink's limit that keeps pairs of geoms apart, every one of them.

    Mink's own filter would drop neighbours: base against obstacle, for one.

    Args:
        shapes: MuJoCo's model with the geoms.
        pairs: names of geoms.
        margin: signed distance to keep [m].
        reach: distance at which a pair enters the problem [m].
        gain: share of the distance that may be lost in a step.
    """
    mink = import_mink()

    class EveryPair(mink.CollisionAvoidanceLimit):
        def _construct_geom_id_pairs(self, geom_pairs: Any) -> list[tuple[int, int]]:
            return [(self.model.geom(a).id, self.model.geom(b).id) for (a,), (b,) in geom_pairs]

    return EveryPair(
        shapes,
        [([first], [second]) for first, second in pairs],
        gain=gain,
        minimum_distance_from_collisions=margin,
        collision_detection_distance=reach,
    )
