"""The one-step safety filter with control barrier functions: the classical rival of the predictive one."""

import daqp
import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.baselines.reactive import ReactiveController
from handrail.controllers.errors import HandrailError
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent
from handrail.controllers.interface.usual_frames import commanded_rows
from handrail.controllers.robot.model import RobotModel

ALPHA = 1.0
"""How fast a distance may shrink, relative to what is left above its margin [1/s].

Braking from v along `d' = -α (d - margin)` takes `α v`: above a_max / v_max it asks for more than the robot
has.
"""
MARGIN = 0.10  # signed distance kept between shapes, at scale 1 [m]
_WORK_MARGIN = 0.008  # the same between tool shapes and work surfaces [m]
_ACTIVATION_DISTANCE = 2.0  # beyond the margin, at which a pair gets a row [m]
_SLACK = 1e4  # linear penalty of the slack of the rows, per m/s; and the quadratic one
_DAMPING = 0.01  # λ, as of damped least squares
_INFINITE = 1e30


class CbfFilter(ReactiveController):
    """Sends the joint velocities nearest to the commanded ones that the barriers allow; a controller.

    `min ‖u - u_cmd‖²_W + ρ₁ s + ½ ρ₂ s²  s.t.  ∇d·u + ∂d/∂t ≥ -α (d - margin) - s` for every near pair, with
    u within the limits of velocity and acceleration and able to brake before the position limits, and
    W = diag(1 / v_max²). It looks one step ahead: at high speed the acceleration limit can leave it without
    a solution, and then s > 0. Joints that nobody commands are asked to rest. Of other channels,
    `‖M (C u - û)‖² + λ ‖u‖²_W` stands in place of the first term: what they leave open is as small as can be.

    Args:
        model: of the robot.
        period: time in which a velocity is reached, one control period [s].
    """

    def __init__(self, model: RobotModel, period: float = 0.05) -> None:
        scale = model.description.world.scale
        super().__init__(model, self._filtered, period, margins=(scale * MARGIN, scale * _WORK_MARGIN))

    def _filtered(self, state: State, intent: Intent, previous: FloatArray) -> FloatArray:
        """Return the nearest velocity that is allowed, (n,)."""
        fastest = self._model.description.limits.velocity
        gradients, allowed = self._barriers(state.q)
        hessian, gradient = np.diag(np.append(fastest**-2.0, _SLACK)), np.append(-fastest, _SLACK)
        hessian[:-1, :-1], gradient[:-1] = self._tracking(state.q, intent, fastest)
        matrix = np.hstack([gradients, np.ones((len(allowed), 1))])
        lower, upper = (
            self._limiter.limit(previous, bound, self._period, state.q)[0] for bound in (-fastest, fastest)
        )
        above = np.concatenate([upper, np.full(len(matrix) + 1, _INFINITE)])
        below = np.concatenate([lower, [0.0], allowed])
        solution, _, flag, _ = daqp.solve(hessian, gradient, matrix, above, below)
        if flag <= 0 or not np.isfinite(solution).all():
            raise HandrailError(f"CBF filter: DAQP found no solution (exit flag {flag})")
        self.slack = max(float(solution[-1]), 0.0)
        return solution[:-1]

    def _tracking(self, q: FloatArray, intent: Intent, fastest: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return hessian (n, n) and gradient (n,) of how far a velocity is from what is asked for."""
        joints, weights = self.channels.joint_slice, fastest**-2.0
        others = np.flatnonzero(intent.mask[: joints.start])
        if not len(others):
            asked = np.clip(np.where(intent.mask[joints], intent.values[joints], 0.0), -fastest, fastest)
            return np.diag(weights), -weights * asked
        matrix, asked = commanded_rows(intent, self._model, q)
        return matrix.T @ matrix + _DAMPING * np.diag(weights), -matrix.T @ asked

    def _barriers(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return rows `gradients u ≥ lower` of the R near pairs at q, (R, n) and (R,).

        How the obstacles' own motion changes a distance is seen over a period.
        """
        around, times = self.surroundings.known_at(q), np.array([0.0, self._period])
        within = around.margins + _ACTIVATION_DISTANCE
        distances = around.collision.distances(np.stack([q, q]), within, times)
        self.distances = seen = distances.values[0]
        margins = around.seen(seen).margins
        keep = distances.near[:, 0] == 1
        pair = distances.near[keep, 1]
        now, then = distances.values[:, pair]
        return distances.gradients[keep], -ALPHA * (now - margins[pair]) - (then - now) / self._period
