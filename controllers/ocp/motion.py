"""Motions under accelerations held over stages, and the configurations at which distances are kept."""

from typing import NamedTuple

import numpy as np

from handrail.controllers.arrays import FloatArray

STOPS = (0.375, 0.5)  # of v_N |v_N| / a_max: half way in time of the stop from the last node, and at rest


def rollout(q: FloatArray, v: FloatArray, dt: float, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return positions and velocities, (N + 1, n), from (q, v), (n,), under accelerations u, (N, n).

    `v_k = v_{k-1} + dt u_k`, `q_k = q_{k-1} + dt/2 (v_{k-1} + v_k)`.
    """
    velocities = np.cumsum(np.vstack([v, dt * u]), axis=0)
    ways = 0.5 * dt * (velocities[:-1] + velocities[1:])
    return np.cumsum(np.vstack([q, ways]), axis=0), velocities


class Nodes(NamedTuple):
    """Now, after every stage, and along the final stop."""

    q: FloatArray  # (N + 3, n)
    times: FloatArray  # from now on, (N + 3,) [s]
    gains: FloatArray  # derivative of the stop's two configurations by v_N, (2, n) [s]


def nodes_of(q: FloatArray, v: FloatArray, acceleration: FloatArray, dt: float) -> Nodes:
    """Return the nodes of a motion: positions and velocities (N + 1, n), limits of acceleration, (n,)."""
    stop, shares = np.abs(v[-1]) / acceleration, np.array(STOPS)[:, None]
    times = dt * np.arange(len(q))
    after = times[-1] + stop.max(initial=0.0) * np.array([0.5, 1.0])
    return Nodes(np.vstack([q, q[-1] + shares * stop * v[-1]]), np.append(times, after), 2.0 * shares * stop)
