"""What is wrong with a robot's description, one line each."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.errors import HandrailError
from handrail.controllers.modelling.clouds import LinkCloud, link_clouds
from handrail.controllers.modelling.home import freedom
from handrail.controllers.modelling.limits import FASTEST
from handrail.controllers.modelling.pairs import configurations, count_meetings, meetings, outside
from handrail.controllers.robot.model import RobotModel, joints_of, load_model

_SAMPLES = 2000
_OUT = 0.04  # that a link may stick out of its shapes [m]
_OVER = 1e-3  # of a position limit beyond the URDF's [rad, m]
_SLOWEST, _SOONEST = 5.0, 0.05  # to full velocity [s]
_ROOM, _FREE = 0.02, 0.02  # least of a home: to a limit [rad], singular value at a reach of 1 m
_LOOKS = 40  # configurations in which it is asked whether meshes meet


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
        name, fastest = model.joints[index], FASTEST[int(joints_of(model)[index].prismatic)]
        velocity = float(limits.velocity[index])
        if velocity > fastest:
            yield f"limits of joint {name}: expected a velocity of at most {fastest}, got {velocity}"
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
        own = [
            outside(model, placed, cloud.points)
            for placed in model.description.collision
            if model.mount(placed)[0] == cloud.joint
        ]
        out = float(np.min(own, axis=0).max()) if own else np.inf
        if out > _OUT:
            yield f"link {cloud.link}: no collision shape encloses it" + (
                f", it sticks out by {out:.2f} m" if own else ""
            )


def _of_pairs(model: RobotModel, clouds: list[LinkCloud]) -> Iterator[str]:
    """Yield pairs whose links meet where no listed pair does, and no others always do."""
    drawn = configurations(model, _SAMPLES, np.random.default_rng(0))
    met, listed = (
        meetings(model, clouds, drawn, 0.0),
        {frozenset(pair) for pair in model.description.self_pairs},
    )
    known = np.array([frozenset(pair) in listed for pair in met.pairs], dtype=bool)
    clear = ~(met.distances[:, known] < 0.0).any(axis=1)
    for index in np.flatnonzero(~known & (met.nearest < 0.0)):
        near, pair = met.q[clear & (met.links[:, index] < 0.0)][:_LOOKS], met.pairs[index]
        if pair not in met.always and count_meetings(model, clouds, pair, near):
            yield f"self_collision: pairs: {pair[0]} and {pair[1]} can meet, and are not listed"
