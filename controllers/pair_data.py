"""Coal's working data of shape pairs, and how its results are read."""

import numpy as np
import pinocchio as pin

from handrail.controllers.arrays import BoolArray, FloatArray, IntArray


class PairData:
    """Coal's working data for some pairs, with a reader of its results."""

    def __init__(
        self, model: pin.Model, data: pin.Data, geometry: pin.GeometryModel, neutral: FloatArray
    ) -> None:
        self.geometry = pin.GeometryData(geometry)
        pin.computeDistances(model, data, geometry, self.geometry, neutral)
        self.results = ResultReader(self.geometry.distanceResults)
        self._selected = np.ones(len(geometry.collisionPairs), dtype=bool)

    def select(self, wanted: BoolArray) -> IntArray:
        """Measure just these pairs from now on, (P,); return their indices."""
        for pair in np.flatnonzero(wanted != self._selected).tolist():
            if wanted[pair]:
                self.geometry.activateCollisionPair(pair)
            else:
                self.geometry.deactivateCollisionPair(pair)
        self._selected = wanted
        return np.flatnonzero(wanted)


class ResultReader:
    """Reads normals and nearest points of all pairs at once.

    Coal's results lie in one C++ vector, each with normal and both nearest points side by side, and the
    binding hands out views of that memory: one strided view reads them all. Where a build lays them out
    otherwise, they are read one by one.

    Args:
        results: of pairs that have been computed at least once.
    """

    def __init__(self, results: pin.StdVec_DistanceResult) -> None:
        self._results = results
        self._view = self._strided(results)

    def read(self) -> FloatArray:
        """Return normals, first and second nearest points in the world, side by side, (P, 9)."""
        return self._one_by_one() if self._view is None else self._view

    def _strided(self, results: pin.StdVec_DistanceResult) -> FloatArray | None:
        normals = [result.normal for result in results]
        addresses = np.array([normal.__array_interface__["data"][0] for normal in normals])
        strides = np.unique(np.diff(addresses))
        if not normals or normals[0].flags.owndata or strides.size != 1 or strides[0] < 72:
            return None
        view = np.lib.stride_tricks.as_strided(
            normals[0], (len(normals), 9), (int(strides[0]), 8), writeable=False
        )
        return view if np.array_equal(view, self._one_by_one()) else None

    def _one_by_one(self) -> FloatArray:
        rows = [[*r.normal, *r.getNearestPoint1(), *r.getNearestPoint2()] for r in self._results]
        return np.array(rows).reshape(-1, 9)
