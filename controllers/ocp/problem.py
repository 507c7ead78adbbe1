"""The masked optimal control problem of one update (the paper's equation 6), as a value."""

from typing import NamedTuple

import numpy as np

from handrail.controllers.arrays import FloatArray, IntArray
from handrail.controllers.collision.model import CollisionModel
from handrail.controllers.core.library import constant
from handrail.controllers.ocp.motion import rollout
from handrail.controllers.robot.parts import Limits

RECOVERY = constant("RECOVERY")  # of what is missing at first, the share that may be left after each node
_AT_END = 1e-3  # a joint beyond its range by less is at its end, by the solver's rounding [m, rad]


class Problem(NamedTuple):
    """`min Σ_k ½ ‖r(q_k, v_k, u_k; p) - ref_k‖²_W_k + Σ_i (ρ₁ σ_i + ½ ρ₂ σ_i²)` over N stages.

    Dynamics: `v_k = v_{k-1} + dt u_k`, `q_k = q_{k-1} + dt v_{k-1} + ½ dt² u_k`. Hard: `|u| ≤ a_max`.
    Soft, each kind with a slack of its own (slacks.py): velocity limits, position limits, shifted where a
    joint is beyond them (`range_shift`), and for every pair `d_p(q_k) ≥ margin_p`. The terminal set X_f
    asks the same of the stop from the last node: `q_N + ½ v_N |v_N| / a_max`, half way and at rest.
    """

    q: FloatArray  # position now, (n,)
    v: FloatArray  # velocity now, (n,)
    sent: FloatArray  # velocity that is being sent, with which the plan begins, (n,)
    dt: float  # length of a stage [s]
    reference: FloatArray  # of every residual row, (N, r)
    weights: FloatArray  # of every residual row, (N, r)
    parameters: FloatArray  # p of the objectives, (k,)
    limits: Limits  # of the robot
    collision: CollisionModel  # the pairs that keep apart
    margins: FloatArray  # smallest distance wanted of each pair [m], (P,)
    activation_distance: float  # distance beyond the margin at which a pair enters the problem [m]
    slack_linear: float  # ρ₁
    slack_quadratic: float  # ρ₂

    @property
    def horizon(self) -> int:
        """Number of stages N."""
        return len(self.reference)

    @property
    def range_shift(self) -> FloatArray:
        """Shift of the joints' ranges at the nodes after now, (N, n): 0 for a joint that is within its own.

        The range of one that is beyond comes back with it: by a share of the way at every node, or else as
        fast as the joint can. Then that joint needs no slack, which would let all others leave their range.
        """
        limits, nodes = self.limits, np.arange(self.horizon + 1)[:, None]
        excess = self.q - np.clip(self.q, limits.position_lower, limits.position_upper)
        away = np.sign(excess) * (np.abs(excess) > _AT_END)
        speeds = np.maximum(away * self.v - self.dt * nodes * limits.acceleration, -limits.velocity)
        ways = np.cumsum(0.5 * self.dt * (speeds[:-1] + speeds[1:]), axis=0)
        return away * np.maximum(np.abs(excess) + ways, np.abs(excess) * RECOVERY ** nodes[1:])

    def rollout(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return positions and velocities at the N + 1 nodes under accelerations u, (N, n)."""
        return rollout(self.q, self.v, self.dt, u)


class Plan(NamedTuple):
    """A solution: trajectories, slack, and how the solver fared. Its arrays are read-only."""

    q: FloatArray  # positions at the nodes, (N + 1, n)
    v: FloatArray  # velocities at the nodes, (N + 1, n)
    u: FloatArray  # accelerations of the stages, (N, n)
    collision_slack: float  # largest violation of a distance against its margin in the plan [m]
    limit_slack: float
    """Largest excess over a position limit, relative to half its range; velocity limits share it with a
    thousandth of its size."""
    distances: FloatArray  # signed distances now, (P,)
    solved: bool  # whether the solver reports a solution
    rows: int = 0  # inequality rows of the last QP, bounds left out
    active: IntArray = np.empty(0, dtype=int)
    """Names of those that hold with equality, for the next problem among the same pairs."""
