"""Looks at contacts: those that a robot should not have, and those by which it holds a thing."""

from collections.abc import Iterable

import numpy as np

from handrail.collect.gl import MjData, MjModel
from handrail.controllers.arrays import BoolArray

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
        pairs = (
            (self._model.geom(first).name, self._model.geom(second).name) for first, second in self._pairs
        )
        return tuple(sorted(" – ".join(sorted(pair)) for pair in pairs))


class GraspMonitor:
    """Sees which movable things the fingers hold: those that every finger touches.

    Args:
        model: the compiled model.
        fingers: names of their geoms.
        movable: names of the bodies that can be grasped and carried.
    """

    def __init__(self, model: MjModel, fingers: Iterable[str], movable: Iterable[str]) -> None:
        self._bodies = model.geom_bodyid
        self._fingers = [model.geom(name).id for name in fingers]
        self._movable = {int(model.body(name).id): name for name in movable}

    def held(self, data: MjData) -> tuple[str, ...]:
        """Return the names of what is held at this instant."""
        if not (self._fingers and self._movable and data.ncon):
            return ()
        pairs = data.contact.geom
        touched = [
            set(self._bodies[pairs[(pairs == finger).any(axis=1)]].ravel().tolist())
            for finger in self._fingers
        ]
        both = set.intersection(*touched)
        return tuple(name for body, name in self._movable.items() if body in both)


def _forbidden_pairs() -> BoolArray:
    """Return which kinds may not touch, (4, 4)."""
    forbidden = np.zeros((4, 4), dtype=bool)
    forbidden[(_ROBOT, _GRASP), :] = True
    forbidden[:, (_ROBOT, _GRASP)] = True
    forbidden[_GRASP, _MOVABLE] = forbidden[_MOVABLE, _GRASP] = False
    return forbidden
