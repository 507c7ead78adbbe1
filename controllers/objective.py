"""Objectives of a stage: residuals written once, as CasADi expressions."""

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray
from handrail.controllers.channels import Channels
from handrail.controllers.model import RobotModel
from handrail.controllers.symbolic import SymbolicPose, symbolic_pose


@dataclass(frozen=True)
class Stage:
    """The symbols of one stage: q, v after it and the acceleration u during it, (n, 1) each."""

    q: ca.SX
    v: ca.SX
    u: ca.SX
    tool: SymbolicPose


@dataclass(frozen=True)
class Objective:
    """A least-squares term `½ Σ w (r(q, v, u) - reference)²` of every stage.

    Attributes:
        name: what it is for.
        residual: the expression r of a stage, (rows, 1).
        reference: what r should be, (rows,); channels take the intent instead.
        weights: mask of the commanded channels (m,) → w, (rows,).
    """

    name: str
    residual: Callable[[Stage], ca.SX]
    reference: FloatArray
    weights: Callable[[BoolArray], FloatArray]


def channel_velocities(stage: Stage, channels: Channels) -> ca.SX:
    """Return the realised velocity on every channel, (m, 1): base twist, tool twist, joint velocities."""
    rows = []
    if channels.base:
        c, s = ca.cos(stage.q[2]), ca.sin(stage.q[2])
        vx, vy, wz = stage.v[0], stage.v[1], stage.v[2]
        rows += [c * vx + s * vy, -s * vx + c * vy, wz]
    return ca.vertcat(*rows, stage.tool.jacobian @ stage.v, stage.v)


def tracking(channels: Channels, weights: FloatArray) -> Objective:
    """Track the intent on the commanded channels: `‖M (c(q, v) - c_ref)‖²` (the paper's equation 6a).

    Args:
        channels: of the robot.
        weights: one a channel, (m,).
    """
    return Objective(
        name="tracking",
        residual=lambda stage: channel_velocities(stage, channels),
        reference=np.zeros(channels.size),
        weights=lambda mask: weights * mask,
    )


def velocity_regularisation(channels: Channels, weights: FloatArray) -> Objective:
    """Keep slow what nobody commands: `‖v‖²` on the joints without a command of their own, (n,)."""
    return Objective(
        name="velocity",
        residual=lambda stage: stage.v,
        reference=np.zeros(len(weights)),
        weights=lambda mask: weights * ~commanded_joints(channels, mask),
    )


def acceleration_regularisation(weights: FloatArray) -> Objective:
    """Keep the motion smooth: `‖u‖²` on every joint, (n,)."""
    return Objective(
        name="acceleration",
        residual=lambda stage: stage.u,
        reference=np.zeros(len(weights)),
        weights=lambda mask: weights,
    )


def posture(channels: Channels, reference: FloatArray, weights: FloatArray) -> Objective:
    """Draw the joints that nobody commands to a posture while the tool is steered, `‖q - q_ref‖²`, (n,)."""

    def masked(mask: BoolArray) -> FloatArray:
        steered = bool(np.any(mask[channels.tool_slice]))
        return weights * ~commanded_joints(channels, mask) * steered

    return Objective("posture", lambda stage: stage.q, np.array(reference), masked)


def commanded_joints(channels: Channels, mask: BoolArray) -> BoolArray:
    """Return which joints have a command of their own, through a joint or a base channel, (n,)."""
    joints = mask[channels.joint_slice].copy()
    if channels.base:
        joints[:2] |= mask[:2].any()
        joints[2] |= mask[2]
    return joints


class StageResiduals:
    """All objectives' residuals and Jacobians at all stages, in one compiled call.

    Attributes:
        objectives: in the order of the rows.
        rows: number of rows r.
        reference: stacked references, (r,).
        tracking_rows: where the channels lie among the rows.
    """

    def __init__(self, model: RobotModel, objectives: tuple[Objective, ...], horizon: int) -> None:
        n = model.size
        z = ca.SX.sym("z", 3 * n)
        q, v, u = z[:n], z[n : 2 * n], z[2 * n :]
        stage = Stage(q, v, u, symbolic_pose(model, q))
        parts = [objective.residual(stage) for objective in objectives]
        residual = ca.vertcat(*parts)
        self.objectives = objectives
        self.rows = residual.shape[0]
        self.reference = np.concatenate([objective.reference for objective in objectives])
        self._expression = ca.Function("residual", [z], [residual])
        outputs = [residual, ca.densify(ca.jacobian(residual, z))]
        compiled = ca.Function("stage", [z], outputs).map(horizon)
        self._z = np.zeros((horizon, 3 * n))
        self._values = np.zeros((horizon, self.rows))
        self._jacobians = np.zeros((horizon, 3 * n, self.rows))  # column-major in CasADi: transposed here
        self._buffer, self._evaluate = compiled.buffer()
        self._buffer.set_arg(0, memoryview(self._z))
        self._buffer.set_res(0, memoryview(self._values))
        self._buffer.set_res(1, memoryview(self._jacobians))

    @property
    def expression(self) -> ca.Function:
        """The residual of one stage as a CasADi function of z = (q, v, u)."""
        return self._expression

    def weights(self, mask: BoolArray) -> FloatArray:
        """Return the weight of every row under a mask, (r,)."""
        return np.concatenate([objective.weights(mask) for objective in self.objectives])

    def evaluate(self, q: FloatArray, v: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return residuals (N, r) and transposed Jacobians (N, 3n, r); the next call overwrites them."""
        n = q.shape[1]
        self._z[:, :n], self._z[:, n : 2 * n], self._z[:, 2 * n :] = q, v, u
        self._evaluate()
        return self._values, self._jacobians
