"""What an operator may have steered by that a policy does not see: candidates, read from the recording."""

from collections.abc import Iterator

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.controllers.numerics.rotation import turned
from handrail.datasets.demonstrations.demonstration import Demonstration, DoesNotApply
from handrail.datasets.quality.motion import phase_boundaries

BASE_POSE, TIME, GOAL, PREVIOUS = "base pose", "time", "end pose", "previous action"
MEANINGS = {
    BASE_POSE: "where the base stands, and its heading",
    TIME: "seconds since the episode began",
    GOAL: "where this phase will end, known only afterwards: what an operator aims at and does not show",
    PREVIOUS: "what was done a frame before: it shows how slowly actions change, not what is missing",
}
BASE = ("x.pos", "y.pos", "theta.pos")


def hidden_variables(episode: Demonstration) -> dict[str, FloatArray]:
    """Return the candidates that an episode has, by name, `(N, h)` each; the previous action is not here.

    base pose   x, y [m], cos and sin of the heading
    time        t [s]
    end pose    the configuration at the end of the phase minus that of now; of a base in its present axes
    """
    return dict(_each(episode))


def before(actions: FloatArray) -> FloatArray:
    """Return the actions of the frame before, the first frame's its own, `(N, a)`."""
    return np.concatenate([actions[:1], actions[:-1]])


def _each(episode: Demonstration) -> Iterator[tuple[str, FloatArray]]:
    base = _base(episode)
    if base is not None:
        yield BASE_POSE, np.column_stack([base[:, :2], np.cos(base[:, 2]), np.sin(base[:, 2])])
    yield TIME, np.arange(episode.count)[:, None] / episode.fps
    try:
        ends = _ends(episode)
        ahead = episode.configuration[ends] - episode.configuration
    except DoesNotApply:
        return
    if base is not None:
        names = [name for name in episode.entries("state") if name.endswith(".pos")]
        places = [names.index(name) for name in BASE[:2]]
        ahead[:, places] = turned(ahead[:, places].T, -base[:, 2]).T
    yield GOAL, ahead


def _base(episode: Demonstration) -> FloatArray | None:
    """Return where a base is, x, y and heading, `(N, 3)`; None without one."""
    names = episode.entries("state")
    if not set(BASE) <= set(names):
        return None
    return episode.matrix("state")[:, [names.index(name) for name in BASE]]


def _ends(episode: Demonstration) -> np.ndarray:
    """Return the last frame of each frame's phase, `(N,)`."""
    last = np.append(phase_boundaries(episode), episode.count) - 1
    return last[np.searchsorted(last, np.arange(episode.count))]
