"""Coal's working data of shape pairs, and how its results are read."""

import numpy as np
import pinocchio as pin

from handrail.controllers.arrays import BoolArray, FloatArray, IntArray

_STRIDES: set[int] = set()  # between coal's results, that were seen to be right in this process [bytes]


class PairData:
    """Coal's working data for some pairs, which reads normals and nearest points of all pairs at once.

    Coal's results lie in one C++ vector, each with normal and both nearest points side by side, and the
    binding hands out views of that memory: one strided view reads them all. Where a build lays them out
    otherwise, they are read one by one.

    Attributes:
        view: of that memory, (P, 9); None where it does not serve.
    """

    def __init__(
        self, model: pin.Model, data: pin.Data, geometry: pin.GeometryModel, neutral: FloatArray
    ) -> None:
        self.geometry = pin.GeometryData(geometry)
        pin.computeDistances(model, data, geometry, self.geometry, neutral)
        self._results = self.geometry.distanceResults
        self.view = self._strided(self._results)
        self._selected = np.ones(len(geometry.collisionPairs), dtype=bool)
        self._chosen = np.flatnonzero(self._selected)
        self._key = self._selected.tobytes()

    def select(self, wanted: BoolArray) -> IntArray:
        """Measure just these pairs from now on, (P,); return their indices."""
        key = wanted.tobytes()
        if key == self._key:
            return self._chosen
        for pair in np.flatnonzero(wanted != self._selected).tolist():
            if wanted[pair]:
                self.geometry.activateCollisionPair(pair)
            else:
                self.geometry.deactivateCollisionPair(pair)
        self._key, self._selected, self._chosen = key, wanted, np.flatnonzero(wanted)
        return self._chosen

    def read(self) -> FloatArray:
        """Return normals, first and second nearest points in the world, side by side, (P, 9)."""
        return self.one_by_one() if self.view is None else self.view

    def _strided(self, results: pin.StdVec_DistanceResult) -> FloatArray | None:
        if not len(results):
            return None
        first, last = results[0].normal, results[len(results) - 1].normal
        stride, rest = divmod(_address(last) - _address(first), max(len(results) - 1, 1))
        if first.flags.owndata or last.flags.owndata or rest or not 72 <= stride <= 4096:
            return None
        view = np.lib.stride_tricks.as_strided(first, (len(results), 9), (stride, 8), writeable=False)
        if stride not in _STRIDES and np.array_equal(view, self.one_by_one()):
            _STRIDES.add(stride)
        return view if stride in _STRIDES else None

    def one_by_one(self) -> FloatArray:
        """Return what `read` does, (P, 9), asking coal for every pair."""
        rows = [[*r.normal, *r.getNearestPoint1(), *r.getNearestPoint2()] for r in self._results]
        return np.array(rows).reshape(-1, 9)


def _address(array: FloatArray) -> int:
    return array.__array_interface__["data"][0]
