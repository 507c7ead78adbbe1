"""The optimal control problem as a nonlinear program of stages, for IPOPT, which iterates to convergence."""

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.collision.slacks import LIMITS, SLACKS, VELOCITY_SLACK
from handrail.controllers.errors import HandrailError
from handrail.controllers.ocp.problem import Problem
from handrail.controllers.ocp.residuals import StageResiduals
from handrail.controllers.solvers.reference.evaluation import limit_slack
from handrail.controllers.solvers.reference.linear_distances import LinearDistances

_INSIDE = 1e-3  # how far within the bounds the slacks begin
STOPS = 2  # nodes of the final stop, measured after the last stage

_OPTIONS = {
    "print_time": False,
    "record_time": False,
    "error_on_fail": False,
    "expand": True,
    "ipopt": {
        "print_level": 0,
        "sb": "yes",
        "tol": 1e-7,
        "bound_relax_factor": 0.0,
        "nlp_scaling_method": "none",  # the penalties would scale the cost, and its tolerance, by 1e-3
        "mu_strategy": "adaptive",  # the fastest here
    },
}


@dataclass(frozen=True)
class Solution:
    """Accelerations (N, n), the cost with linearised distances, whether it converged, and iterations."""

    u: FloatArray
    cost: float
    solved: bool
    iterations: int


class MultistageProgram:
    """`min Σ l(F(x_k, u_k), u_k) + Σ_i (ρ₁ σ_i + ½ ρ₂ σ_i²)` with x = (q, v, σ), `x_{k+1} = F(x_k, u_k)`.

    The dynamics are those of `Problem`. The slacks, which all nodes share, are states that stay what they
    are, `σ_{k+1} = σ_k`: shared without any constraint across stages. Variables and constraints are in the
    order of the stages: the gap to the next state first, then what holds at the stage.

    Args:
        residuals: of one stage.
        horizon: stages N.
        size: coordinates n.
        dt: length of a stage [s].
        rows: distance rows at a node R.
    """

    def __init__(self, residuals: StageResiduals, horizon: int, size: int, dt: float, rows: int) -> None:
        self._shape = (horizon, size)
        self._rows = rows
        symbols = _Symbols(residuals, horizon, size, rows)
        self._solver = ca.nlpsol("program", "ipopt", _program(symbols, residuals.expression, dt), _OPTIONS)

    def solve(
        self, problem: Problem, guess: FloatArray, distances: LinearDistances, trust: FloatArray
    ) -> Solution:
        """Return the minimum near a guess.

        Args:
            problem: of which state, references, weights, limits and penalties are taken.
            guess: accelerations, (N, n).
            distances: linearised, with as many rows at a node as the program has.
            trust: largest change of the accelerations, (n,).

        Raises:
            HandrailError: CasADi fails; that the solver does not converge is no failure.
        """
        limit = np.broadcast_to(problem.limits.acceleration, guess.shape)
        lower, upper = np.maximum(-limit, guess - trust), np.minimum(limit, guess + trust)
        count = 2 * self._shape[1] + SLACKS
        least = np.full((self._shape[0] + 1, count), -np.inf)
        least[:, -SLACKS:] = 0.0
        q, v = problem.rollout(guess)
        states = np.hstack([q, v, np.tile(self._slacks(problem, q, v, distances), (len(q), 1))])
        bounds = self._constraint_bounds(distances)
        result = _translated(
            lambda: self._solver(
                x0=_interleave(states, guess),
                lbx=_interleave(least, lower),
                ubx=_interleave(np.full_like(least, np.inf), upper),
                lbg=bounds[0],
                ubg=bounds[1],
                p=_parameters(problem, distances),
            )
        )
        stats = self._solver.stats()
        variables = np.array(result["x"]).ravel()
        table = variables[:-count].reshape(self._shape[0], -1)
        return Solution(
            table[:, count:], float(result["f"]), bool(stats["success"]), int(stats["iter_count"])
        )

    def _slacks(
        self, problem: Problem, q: FloatArray, v: FloatArray, distances: LinearDistances
    ) -> FloatArray:
        """Return slacks with which a trajectory obeys everything, and a little more, (4,)."""
        short = distances.lower - distances.at(q, v)
        kinds = [np.max(short[distances.kind == kind], initial=0.0) for kind in range(LIMITS)]
        return np.append(kinds, limit_slack(problem, q, v)) + _INSIDE

    def _constraint_bounds(self, distances: LinearDistances) -> tuple[FloatArray, FloatArray]:
        horizon, size = self._shape
        lower, upper = (np.zeros(self._solver.size1_out("g")) for _ in range(2))
        start = 2 * (2 * size + SLACKS) - SLACKS  # gap and initial state of the first stage
        for stage in range(1, horizon + 1):
            start += 2 * size + SLACKS if stage < horizon else 0
            lower[start : start + 4 * size] = -np.inf
            upper[start : start + 4 * size] = 1.0
            start += 4 * size
            nodes = slice(stage - 1, stage) if stage < horizon else slice(stage - 1, None)
            asked = distances.lower[nodes].ravel()
            lower[start : start + len(asked)] = asked
            upper[start : start + len(asked)] = np.inf
            start += len(asked)
        return lower, upper


class _Symbols:
    """The parameters of the program: state, penalties, limits; of every stage: reference, weights, rows."""

    def __init__(self, residuals: StageResiduals, horizon: int, size: int, rows: int) -> None:
        self.horizon, self.size, self.rows = horizon, size, rows
        self.state = ca.MX.sym("state", 2 * size)
        self.penalties = ca.MX.sym("penalties", 2)
        self.middle = ca.MX.sym("middle", 2 * size)
        self.scale = ca.MX.sym("scale", 2 * size)
        self.parameters = ca.MX.sym("parameters", len(residuals.parameters))
        self.reference = ca.MX.sym("reference", residuals.size, horizon)
        self.weights = ca.MX.sym("weights", residuals.size, horizon)
        self.by_state = ca.MX.sym("by_state", (2 * size + SLACKS) * rows, horizon + STOPS)  # row by row

    @property
    def vector(self) -> ca.MX:
        """All of them, in the order of `_parameters`."""
        parts = (self.state, self.penalties, self.middle, self.scale, self.parameters)
        return ca.veccat(*parts, self.reference, self.weights, self.by_state)

    def distance_rows(self, node: int, x: ca.MX) -> ca.MX:
        """Return `by_q q + by_v v + σ` of a node after now, from 0 on, (R, 1)."""
        return ca.reshape(self.by_state[:, node], 2 * self.size + SLACKS, self.rows).T @ x

    def limit_rows(self, x: ca.MX) -> ca.MX:
        """Return how far positions and velocities are from the middle of their range, ≤ 1, (4n, 1)."""
        values = (x[: 2 * self.size] - self.middle) / self.scale
        share = np.repeat([1.0, VELOCITY_SLACK], self.size)
        return ca.vertcat(values, -values) - x[2 * self.size + LIMITS] * np.tile(share, 2)


def _parameters(problem: Problem, distances: LinearDistances) -> FloatArray:
    limits = problem.limits
    zero = np.zeros(len(problem.q))
    by_state = np.concatenate([distances.by_q, distances.by_v, np.eye(SLACKS)[distances.kind]], axis=2)
    return np.concatenate(
        [
            *(problem.q, problem.v, [problem.slack_linear, problem.slack_quadratic]),
            *(0.5 * (limits.position_upper + limits.position_lower), zero),
            *(0.5 * (limits.position_upper - limits.position_lower), limits.velocity, problem.parameters),
            *(problem.reference.ravel(), problem.weights.ravel(), by_state.ravel()),
        ]
    )


def _penalty(problem: Problem, slack: FloatArray) -> float:
    return float(problem.slack_linear * slack.sum() + 0.5 * problem.slack_quadratic * slack @ slack)


def _program(symbols: _Symbols, residual: ca.Function, dt: float) -> dict[str, ca.MX]:
    """Return the nonlinear program."""
    horizon, size = symbols.horizon, symbols.size
    states = [ca.MX.sym(f"x{k}", 2 * size + SLACKS) for k in range(horizon + 1)]
    inputs = [ca.MX.sym(f"u{k}", size) for k in range(horizon)]
    step, cost = _step(size, dt), _stage_cost(residual, size)
    objective, constraints = ca.MX(0), []
    for k in range(horizon):
        after = step(states[k], inputs[k])
        z = ca.vertcat(after[: 2 * size], inputs[k])
        objective += cost(z, symbols.parameters, symbols.reference[:, k], symbols.weights[:, k])
        constraints.append(states[k + 1] - after)
        if k == 0:
            constraints.append(states[0][: 2 * size] - symbols.state)
        else:
            constraints += [symbols.limit_rows(states[k]), symbols.distance_rows(k - 1, states[k])]
    constraints.append(symbols.limit_rows(states[-1]))
    constraints += [symbols.distance_rows(node, states[-1]) for node in range(horizon - 1, horizon + STOPS)]
    slack = states[-1][2 * size :]
    objective += symbols.penalties[0] * ca.sum1(slack) + 0.5 * symbols.penalties[1] * ca.sumsqr(slack)
    variables = [part for pair in zip(states, inputs, strict=False) for part in pair]
    nlp = {"x": ca.vertcat(*variables, states[-1]), "f": objective, "g": ca.vertcat(*constraints)}
    return {**nlp, "p": symbols.vector}


def _step(size: int, dt: float) -> ca.Function:
    x, u = ca.SX.sym("x", 2 * size + SLACKS), ca.SX.sym("u", size)
    v = x[size : 2 * size]
    after = ca.vertcat(x[:size] + dt * v + 0.5 * dt * dt * u, v + dt * u, x[2 * size :])
    return ca.Function("step", [x, u], [after])


def _stage_cost(residual: ca.Function, size: int) -> ca.Function:
    z, p = ca.SX.sym("z", 3 * size), ca.SX.sym("p", residual.size1_in(1))
    reference, weights = (ca.SX.sym(name, residual.size1_out(0)) for name in ("reference", "weights"))
    error = residual(z, p) - reference
    return ca.Function("cost", [z, p, reference, weights], [0.5 * ca.dot(weights, error * error)])


def _interleave(states: FloatArray, inputs: FloatArray) -> FloatArray:
    """Return x_0, u_0, x_1, …, x_N in a row."""
    return np.append(np.hstack([states[:-1], inputs]).ravel(), states[-1])


def _translated[Result](call: Callable[[], Result]) -> Result:
    try:
        return call()
    except RuntimeError as error:
        said = " ".join(str(error).split())
        raise HandrailError(f"converged solver: CasADi failed: {said[-200:]}") from error
