"""All objectives' residuals at all stages: constant rows kept as matrices, the others compiled by CasADi."""

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray, IntArray
from handrail.controllers.errors import HandrailError, check_known
from handrail.controllers.numerics.compiled import compiled
from handrail.controllers.objectives.objective import Objective, Stage
from handrail.controllers.robot.model import RobotModel


@dataclass(frozen=True)
class AffineRows:
    """Rows `r = J z + c` of z = (q, v, u) whose Jacobian never changes."""

    index: IntArray  # where they lie among all rows, (a,)
    jacobian: FloatArray  # J, (a, 3n)
    offset: FloatArray  # c, (a,)


class StageResiduals:
    """The stacked residual r(z; p) of one stage, z = (q, v, u), evaluated at N stages.

    Attributes:
        objectives: in the order of the rows.
        reference: stacked references, (r,).
        affine: the rows with a constant Jacobian.
        curved: where the other rows lie, (c,).
        expression: the residual of one stage as a CasADi function of (z, p).
        arrays: `z` of all stages, (N, 3n); `values`, (N, c), and `jacobians`, (N, 3n, c), of the curved rows.
        evaluate: writes values and Jacobians at z; evaluate_values: the values alone.
    """

    def __init__(self, model: RobotModel, objectives: tuple[Objective, ...], horizon: int) -> None:
        n = model.size
        self.objectives = objectives
        if len(set(self.names)) != len(self.names):
            raise HandrailError(f"objectives: expected distinct names, got {', '.join(self.names)}")
        self._slices = _parameter_slices(objectives)
        z = ca.SX.sym("z", 3 * n)
        p = ca.SX.sym("p", sum(len(objective.parameters) for objective in objectives))
        stage = Stage(model, z[:n], z[n : 2 * n], z[2 * n :])
        parts = [objective.residual(stage, p[self._slices[objective.name]]) for objective in objectives]
        residual = ca.vertcat(*parts)
        _check_rows(objectives, parts)
        self.reference = np.concatenate([objective.reference for objective in objectives])
        self.expression = ca.Function("residual", [z, p], [residual])
        self.affine, self.curved = _split(residual, z, p)
        self._buffers: dict[str, object] = {}  # they own what the compiled functions read and write
        self._compile(residual, z, p, horizon, n)

    @property
    def parameters(self) -> FloatArray:
        """Every objective's parameters as they were at the beginning, (k,)."""
        return np.concatenate([objective.parameters for objective in self.objectives])

    @property
    def names(self) -> list[str]:
        """Of the objectives."""
        return [objective.name for objective in self.objectives]

    def parameter_slice(self, name: str) -> slice:
        """Return where an objective's parameters lie."""
        check_known("objective", (name,), self._slices)
        return self._slices[name]

    def weights(self, mask: BoolArray) -> FloatArray:
        """Return the weight of every row under a mask, (r,)."""
        return np.concatenate([objective.weights(mask) for objective in self.objectives])

    def set_parameters(self, parameters: FloatArray) -> None:
        """Take the parameters of all objectives, (k,), for `evaluate` and `evaluate_values`."""
        self._p[:] = parameters

    def _compile(self, residual: ca.SX, z: ca.SX, p: ca.SX, horizon: int, n: int) -> None:
        curved = ca.densify(residual[self.curved.tolist()])
        self._p = np.zeros((horizon, p.shape[0]))
        self.arrays = {
            "z": np.zeros((horizon, 3 * n)),
            "values": np.zeros((horizon, len(self.curved))),
            "jacobians": np.zeros((horizon, 3 * n, len(self.curved))),  # column-major in CasADi
        }
        jacobian = ca.densify(ca.jacobian(curved, z))
        self.evaluate_values = self._bound("values", [z, p], [curved])
        self.evaluate = self._bound("stage", [z, p], [curved, jacobian])

    def _bound(self, name: str, inputs: list[ca.SX], outputs: list[ca.SX]) -> Callable[[], None]:
        """Return a function of all stages, compiled, that reads and writes this object's arrays."""
        function = compiled(ca.Function(name, inputs, outputs)).map(len(self._p))
        buffer, evaluate = function.buffer()
        z, *results = self.arrays.values()
        buffer.set_arg(0, memoryview(z))
        buffer.set_arg(1, memoryview(self._p))
        for index, result in enumerate(results[: len(outputs)]):
            buffer.set_res(index, memoryview(result))
        self._buffers[name] = buffer
        return evaluate


def _parameter_slices(objectives: tuple[Objective, ...]) -> dict[str, slice]:
    ends = np.cumsum([len(objective.parameters) for objective in objectives])
    return {
        o.name: slice(int(end) - len(o.parameters), int(end)) for o, end in zip(objectives, ends, strict=True)
    }


def _check_rows(objectives: tuple[Objective, ...], parts: list[ca.SX]) -> None:
    for objective, part in zip(objectives, parts, strict=True):
        if part.shape != (len(objective.reference), 1):
            raise HandrailError(
                f"objective {objective.name}: expected a residual of {len(objective.reference)} rows "
                f"like its reference, got shape {part.shape}"
            )


def _split(residual: ca.SX, z: ca.SX, p: ca.SX) -> tuple[AffineRows, IntArray]:
    """Return the rows that are affine in z and free of p, and the indices of the others."""
    jacobian = ca.jacobian(residual, z)
    varying = np.zeros(residual.shape[0], dtype=bool)
    everything = ca.vertcat(z, p)
    varying |= np.array(ca.which_depends(residual, everything, 2, True), dtype=bool)
    if p.shape[0]:
        varying |= np.array(ca.which_depends(residual, p, 1, True), dtype=bool)
    index = np.flatnonzero(~varying)
    zero = np.zeros(z.shape[0]), np.zeros(p.shape[0])
    matrix = np.array(ca.Function("J", [z, p], [ca.densify(jacobian)])(*zero))
    offset = np.array(ca.Function("r", [z, p], [ca.densify(residual)])(*zero)).ravel()
    return AffineRows(index, matrix[index], offset[index]), np.flatnonzero(varying)
