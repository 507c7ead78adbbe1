"""The nearest pair of the robot and itself, or of the robot and what stands around."""

from typing import Any

import numpy as np

from handrail.collect.world.geometry import ROBOT_BIT
from handrail.collect.world.gl import MjData, MjModel, mujoco

_FAR = 0.5  # farther is not looked for [m]


class NearestPair:
    """Measures the robot of a compiled model; what it may carry or pull is left out."""

    def __init__(self, model: MjModel) -> None:
        self._model = model
        robot = [g for g in range(model.ngeom) if model.geom_contype[g] & ROBOT_BIT]
        bodies = {int(model.body_rootid[model.geom_bodyid[g]]) for g in robot}
        scene = [
            g
            for g in np.flatnonzero((model.geom_contype | model.geom_conaffinity) > 0).tolist()
            if (body := model.geom_bodyid[g])
            and not model.body_dofnum[body]  # nothing that can be moved
            and int(model.body_rootid[body]) not in bodies  # no part of the robot, as a finger is
        ]
        own = zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True)
        pairs = [*own, *((first, second) for first in robot for second in scene)]
        self._first, self._second = np.array(pairs, dtype=np.intp).reshape(-1, 2).T
        self._radii = model.geom_rbound[self._first] + model.geom_rbound[self._second]

    def find(self, data: MjData) -> dict[str, Any] | None:
        """Return the nearest pair now: its points (6,), distance [m] and names; None where nothing is near.

        Pairs are looked at in the order of their bounding spheres' distances, until no other can be nearer.
        """
        between = data.geom_xpos[self._first] - data.geom_xpos[self._second]
        bounds = np.sqrt(np.einsum("ij,ij->i", between, between)) - self._radii
        best, line, found = _FAR, np.zeros(6), None
        for index in np.argsort(bounds).tolist():
            if bounds[index] >= best:
                break
            first, second = int(self._first[index]), int(self._second[index])
            distance = mujoco.mj_geomDistance(self._model, data, first, second, best, line)
            if distance < best:
                best, found = distance, (first, second, tuple(np.round(line, 3).tolist()))
        if found is None:
            return None
        first, second, points = found
        names = self._name(first), self._name(second)
        return {"points": points, "distance": round(best, 4), "names": names}

    def _name(self, geom: int) -> str:
        name = self._model.geom(geom).name or self._model.body(self._model.geom_bodyid[geom]).name
        return name.replace("_", " ")
