"""Faults of a robot's description, one line each."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.modelling.clouds import LinkCloud, link_clouds
from handrail.controllers.modelling.home import freedom
from handrail.controllers.modelling.limits import FASTEST
from handrail.controllers.modelling.pairs import Meetings, outside
from handrail.controllers.robot.model import RobotModel, joints_of, load_model

_SAMPLES = 2000
_OUT = 0.04  # that a link may stick out of its shapes [m]
_OVER = 1e-3  # of a position limit beyond the URDF's [rad, m]
_SLOWEST, _SOONEST = 5.0, 0.05  # to full velocity [s]
_ROOM, _FREE = 0.02, 0.02  # least of a home: to a limit [rad], singular value at a reach of 1 m


def faults(robot: str | Path) -> list[str]:
    """Return what is wrong with a robot, by name or description file; nothing where it can be used."""
    try:
        model = load_model(robot)
        clouds = link_clouds(model)
        return [*_of_limits(model), *_of_home(model), *_of_shapes(model, clouds), *_of_pairs(model, clouds)]
    except HandrailError as error:
        return [str(error)]


def _of_limits(model: RobotModel) -> Iterator[str]:
    limits, urdf, base = model.description.limits, model.pinocchio, len(model.description.base.joints)
    for index in range(model.size):
        name, velocity = model.joints[index], float(limits.velocity[index])
        fastest = min(FASTEST[int(joints_of(model)[index].prismatic)], urdf.velocityLimit[index] or np.inf)
        if velocity > fastest + _OVER:
            yield f"limits of joint {name}: expected a velocity of at most {fastest:.6g}, got {velocity}"
        time = velocity / float(limits.acceleration[index])
        if not _SOONEST <= time <= _SLOWEST:
            yield f"limits of joint {name}: expected full velocity in {_SOONEST} to {_SLOWEST} s"
        ends = urdf.lowerPositionLimit[index], urdf.upperPositionLimit[index]
        given = limits.position_lower[index], limits.position_upper[index]
        if index >= base and (given[0] < ends[0] - _OVER or given[1] > ends[1] + _OVER):
            expected, got = (" to ".join(f"{end:.4g}" for end in each) for each in (ends, given))
            yield f"limits of joint {name}: expected positions inside the URDF's {expected}, got {got}"


def _of_home(model: RobotModel) -> Iterator[str]:
    home, collision = model.description.home, CollisionModel(model)
    for pair, distance in zip(collision.pairs, collision.values(home[None])[0], strict=True):
        if distance < 0.0:
            yield f"home: {pair[0]} and {pair[1]} overlap by {-distance:.3f} m"
    room, free = freedom(model, home, 1.0)
    if room < _ROOM:
        yield f"home: expected joints of the hands {_ROOM} rad from their limits, got {room:.3f}"
    if free < _FREE:
        yield f"home: near a singularity, where a hand can hardly move one way: singular value {free:.3f}"


def _of_shapes(model: RobotModel, clouds: list[LinkCloud]) -> Iterator[str]:
    for cloud in clouds:
        shapes, points = model.description.collision, cloud.triangles.reshape(-1, 3)
        own = [outside(model, each, points) for each in shapes if model.mount(each)[0] == cloud.joint]
        out = float(np.min(own, axis=0).max()) if own else np.inf
        if out > _OUT:
            word = f", it sticks out by {out:.2f} m" if own else ""
            yield f"link {cloud.link}: no collision shape encloses it{word}"


def _of_pairs(model: RobotModel, clouds: list[LinkCloud]) -> Iterator[str]:
    """Yield pairs whose meshes meet where no listed pair does, and seldom do."""
    met = Meetings(model, clouds, _SAMPLES)
    listed = {frozenset(pair) for pair in model.description.self_pairs}
    known = np.array([frozenset(pair) in listed for pair in met.pairs], dtype=bool)
    clear = ~(met.distances[:, known] < 0.0).any(axis=1)
    for index in np.flatnonzero(~known & (met.distances.min(axis=0) < 0.0)):
        near = np.flatnonzero(clear & (met.distances[:, index] < 0.0))
        if met.joints[index] not in met.nested and met.touching(index, near).any():
            yield f"self_collision: pairs: {' and '.join(met.pairs[index])} can meet, and are not listed"
