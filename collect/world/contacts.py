"""Looks at contacts: those that a robot should not have, and those by which it holds a thing."""

from collections.abc import Iterable

import numpy as np

from handrail.collect.world.gl import MjData, MjModel
from handrail.controllers.arrays import BoolArray, FloatArray

_SCENE, _ROBOT, _GRASP, _MOVABLE = range(4)


class ContactMonitor:
    """Collects forbidden contacts: the robot with anything but fingers or palm with a movable thing.

    The robot's contacts with itself count; its wheels' with the floor do not exist in the model.
    """

    def __init__(
        self, model: MjModel, robot: Iterable[str], grasp: Iterable[str], movable: Iterable[str]
    ) -> None:
        self._model = model
        kinds = np.zeros(model.ngeom, dtype=np.intp)
        for names, kind in ((robot, _ROBOT), (grasp, _GRASP)):
            kinds[[model.geom(name).id for name in names]] = kind
        bodies = [model.body(name).id for name in movable]
        kinds[np.isin(model.geom_bodyid, bodies)] = _MOVABLE
        self._forbidden = _forbidden_pairs()[np.ix_(kinds, kinds)]
        self._pairs: set[tuple[int, int]] = set()

    def clear(self) -> None:
        """Forget the contacts so far."""
        self._pairs.clear()

    def look(self, data: MjData) -> None:
        """Remember the forbidden contacts of this instant."""
        if data.ncon == 0:
            return
        first, second = data.contact.geom.T
        hit = self._forbidden[first, second]
        if hit.any():
            self._pairs.update(zip(first[hit].tolist(), second[hit].tolist(), strict=True))

    @property
    def names(self) -> tuple[str, ...]:
        """The pairs of geoms that met since the last `clear`, sorted."""
        if not self._pairs:
            return ()
        pairs = (
            (self._model.geom(first).name, self._model.geom(second).name) for first, second in self._pairs
        )
        return tuple(sorted(" – ".join(sorted(pair)) for pair in pairs))


class GraspMonitor:
    """Sees which things the fingers hold: those that they press from opposite sides.

    Args:
        model: the compiled model.
        fingers: names of the geoms of the two; none of a robot without a gripper.
        portable: names of the bodies that can be carried.
    """

    def __init__(self, model: MjModel, fingers: Iterable[str], portable: Iterable[str]) -> None:
        self._bodies = model.geom_bodyid
        self._fingers = [model.geom(name).id for name in fingers]
        self._portable = {int(model.body(name).id): name for name in portable}

    def held(self, data: MjData) -> tuple[str, ...]:
        """Return the names of what is held at this instant."""
        if not (self._fingers and self._portable and data.ncon):
            return ()
        left, right = (self._pushes(data, finger) for finger in self._fingers)
        return tuple(
            name
            for body, name in self._portable.items()
            if body in left and body in right and left[body] @ right[body] < 0.0
        )

    def _pushes(self, data: MjData, finger: int) -> dict[int, FloatArray]:
        """Return which way a finger pushes what it touches: sums of unit normals, (3,), by body."""
        pushes: dict[int, FloatArray] = {}
        for pair, frame in zip(data.contact.geom, data.contact.frame, strict=True):
            if finger in pair:
                other, sign = (pair[1], 1.0) if pair[0] == finger else (pair[0], -1.0)
                body = int(self._bodies[other])
                pushes[body] = pushes.get(body, 0.0) + sign * frame[:3]
        return pushes


def _forbidden_pairs() -> BoolArray:
    """Return which kinds may not touch, (4, 4)."""
    forbidden = np.zeros((4, 4), dtype=bool)
    forbidden[(_ROBOT, _GRASP), :] = True
    forbidden[:, (_ROBOT, _GRASP)] = True
    forbidden[_GRASP, _MOVABLE] = forbidden[_MOVABLE, _GRASP] = False
    return forbidden
