"""Looks at contacts: those that a robot should not have, and those by which it holds a thing."""

from collections.abc import Sequence

import numpy as np

from handrail.collect.world.geometry import ROBOT_BIT
from handrail.collect.world.gl import MjData, MjModel
from handrail.collect.world.scene import Scene
from handrail.controllers.arrays import FloatArray, IntArray

_ROBOT, _GRASP, _MOVABLE = 1, 2, 3  # kinds of geoms; 0 is the scene


class Contacts:
    """Collects forbidden contacts, and sees what the fingers hold: what they press from opposite sides.

    Forbidden is the robot with anything, but fingers or palm with a movable thing. The robot's contacts with
    itself count; its wheels' with the floor do not exist in the model.

    Args:
        model: the compiled model.
        scene: what stands around the robot.
        grasp: names of the geoms that may touch movable things.
        fingers: names of the geoms of each hand's two, which can hold something; () of one that cannot.

    Attributes:
        pairs: of geoms that met forbiddenly since the last `clear`.
    """

    def __init__(
        self, model: MjModel, scene: Scene, grasp: tuple[str, ...], fingers: Sequence[Sequence[str]]
    ) -> None:
        self._model = model
        kinds = np.where(model.geom_contype == ROBOT_BIT, _ROBOT, 0)
        kinds[[model.geom(name).id for name in grasp]] = _GRASP
        bodies = {item.name: int(model.body(item.name).id) for item in scene.movables}
        kinds[np.isin(model.geom_bodyid, list(bodies.values()))] = _MOVABLE
        forbidden = np.zeros((4, 4), dtype=bool)
        forbidden[(_ROBOT, _GRASP), :] = forbidden[:, (_ROBOT, _GRASP)] = True
        forbidden[_GRASP, _MOVABLE] = forbidden[_MOVABLE, _GRASP] = False
        self._forbidden = forbidden[np.ix_(kinds, kinds)]
        self.pairs: frozenset[tuple[int, int]] = frozenset()
        self._seen: dict[bytes, frozenset[tuple[int, int]]] = {}  # forbidden ones, by all that touch
        self._fingers = [[model.geom(name).id for name in pair] for pair in fingers]
        self._portable = {bodies[item.name]: item.name for item in scene.movables if item.slide is None}

    def clear(self) -> None:
        """Forget the forbidden contacts so far."""
        self.pairs = frozenset()

    def look(self, data: MjData) -> None:
        """Remember the forbidden contacts of this instant, at which something touches."""
        touching = data.contact.geom
        place = touching.tobytes()  # mostly as at the instant before
        if place not in self._seen:
            first, second = touching.T
            hit = self._forbidden[first, second]
            self._seen[place] = frozenset(zip(first[hit].tolist(), second[hit].tolist(), strict=True))
        self.pairs |= self._seen[place]

    @property
    def names(self) -> tuple[str, ...]:
        """The pairs of geoms that met since the last `clear`, sorted."""
        pairs = (sorted(self._model.geom(geom).name for geom in pair) for pair in self.pairs)
        return tuple(sorted(" – ".join(pair) for pair in pairs))

    def held(self, data: MjData) -> dict[str, int]:
        """Return what is held at this instant, and by which hand: the first of those that do."""
        found: dict[str, int] = {}
        if not (self._portable and data.ncon):
            return found
        touching = data.contact.geom
        for hand, fingers in enumerate(self._fingers):
            if not fingers or not all((touching == finger).any() for finger in fingers):
                continue
            left, right = (self._pushes(touching, data.contact.frame, finger) for finger in fingers)
            for body, name in self._portable.items():
                if body in left and body in right and left[body] @ right[body] < 0.0:
                    found.setdefault(name, hand)
        return found

    def _pushes(self, touching: IntArray, frames: FloatArray, finger: int) -> dict[int, FloatArray]:
        """Return which way a finger pushes what it touches: sums of unit normals, (3,), by body."""
        pushes: dict[int, FloatArray] = {}
        for pair, frame in zip(touching.tolist(), frames, strict=True):
            if finger in pair:
                other, sign = (pair[1], 1.0) if pair[0] == finger else (pair[0], -1.0)
                body = int(self._model.geom_bodyid[other])
                pushes[body] = pushes.get(body, 0.0) + sign * frame[:3]
        return pushes
