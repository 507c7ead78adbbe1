"""How an episode moved: how long, how smoothly, how directly, and for how much of the time not at all."""

import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray, IntArray
from handrail.datasets.quality.metric import metric
from handrail.datasets.quality.metrics import ldlj, path_length, sparc
from handrail.datasets.quality.pool import ObservationPool
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply

WINDOW = 0.5  # [s]
FLOOR = 0.005  # net motion below which nothing moves: 5 mm where the motion is in metres
SHARE = 0.2  # of the 95th percentile
_LOW, _HIGH = 0.25, 0.75  # of the gripper's range: where it counts as closed and as open again
_STILL = 1e-9  # a path shorter than this is no path, in the unit of the motion


@metric(
    "length", "s", "lower", "how long an episode took, which is the operator's time", title="episode length"
)
def length(episode: Demonstration, pool: ObservationPool) -> float:
    """Return frames over frames a second [s]."""
    return episode.seconds


@metric(
    "sparc",
    "",
    "higher",
    "spectral arc length of the speed: minimum jerk −1.4, more negative is less smooth",
    "motion",
    title="smoothness (SPARC)",
)
def smoothness(episode: Demonstration, pool: ObservationPool) -> float:
    """Return the measure of `metrics.sparc`."""
    return _known(sparc(episode.speed, episode.fps))


@metric(
    "ldlj",
    "",
    "higher",
    "log dimensionless jerk of the speed: minimum jerk −5.2; very sensitive to noise",
    "motion",
    title="smoothness (LDLJ)",
)
def jerkiness(episode: Demonstration, pool: ObservationPool) -> float:
    """Return the measure of `metrics.ldlj`."""
    return _known(ldlj(episode.speed, episode.fps))


@metric(
    "path_efficiency", "", "higher", "straight-line over travelled distance, each phase on its own", "motion"
)
def directness(episode: Demonstration, pool: ObservationPool) -> float:
    """Return the measure of `path_efficiency` of what moves."""
    return path_efficiency(episode.motion, phase_boundaries(episode))


@metric(
    "idle_raw",
    "",
    "lower",
    "share of time with hardly any net motion within 0.5 s",
    "position",
    title="idle, whole episode",
)
def idle_raw(episode: Demonstration, pool: ObservationPool) -> float:
    """Return the share of windows that are idle, see `idle_windows`."""
    return float(idle_windows(episode.motion, episode.fps).mean())


@metric(
    "idle_pruned",
    "",
    "lower",
    "the same up to the last motion",
    "position",
    title="idle, before the final hold",
)
def idle_pruned(episode: Demonstration, pool: ObservationPool) -> float:
    """Return the share without the idle time at the very end.

    Source: the definition of Handrail's own reference, after the pruning of pauses that imitation learning
    code commonly does.
    """
    idle = idle_windows(episode.motion, episode.fps)
    moving = np.flatnonzero(~idle)
    if not moving.size:
        raise DoesNotApply("nothing moves")
    return float(idle[: moving[-1] + 1].mean())


def _known(value: float) -> float:
    if not np.isfinite(value):
        raise DoesNotApply("nothing moves, or the episode is too short")
    return value


def idle_windows(positions: FloatArray, fps: float) -> BoolArray:
    """Return which windows of 0.5 s are idle: ‖x(t + 0.5 s) − x(t)‖ < max(5 mm, 0.2 · p95).

    p95 is the 95th percentile of the same net motion in the episode.

    Args:
        positions: `(N, d)`, any unit.
        fps: Frames a second [Hz].

    Returns:
        For each window, by its first frame, `(N − w,)`.

    Raises:
        DoesNotApply: The episode is not longer than a window.
    """
    width = max(1, round(WINDOW * fps))
    if len(positions) <= width:
        raise DoesNotApply(f"the episode is not longer than {WINDOW} s")
    net = np.linalg.norm(positions[width:] - positions[:-width], axis=1)
    return net < max(FLOOR, SHARE * float(np.percentile(net, 95)))


def path_efficiency(positions: FloatArray, boundaries: IntArray) -> float:
    """Return straight-line over travelled distance, each phase on its own: 1 is straight, 0 goes nowhere.

    Σ_p ‖x(end_p) − x(start_p)‖ / Σ_p ∫_p ‖dx‖. Source: the straightness index of movement analysis
    (Batschelet 1981), summed over phases so that there-and-back is not zero.

    Args:
        positions: `(N, d)`, any unit.
        boundaries: Frames at which a phase ends and the next begins, `(P,)`, rising.

    Raises:
        DoesNotApply: Nothing moves.
    """
    ends = np.unique(np.concatenate(([0], boundaries, [len(positions) - 1])))
    travelled = path_length(positions)
    if travelled <= _STILL:
        raise DoesNotApply("nothing moves")
    return path_length(positions[ends]) / travelled


def phase_boundaries(episode: Demonstration) -> IntArray:
    """Return the frames at which a phase ends and the next begins, `(P,)`.

    Where the recorded phase changes; without one, where the gripper opens or closes; without either or where
    it never does, at the frame that is farthest from the start, so that there-and-back has two phases.
    """
    if episode.has("phase"):
        return _changes(episode.column("phase").reshape(episode.count, -1)[:, 0])
    try:
        found = _changes(gripper_state(episode.gripper))
    except DoesNotApply:
        found = np.empty(0, int)
    return found if found.size else farthest(episode.motion)


def gripper_state(opening: FloatArray) -> IntArray:
    """Return 1 where the gripper is open and 0 where closed, `(N,)`.

    Open from 75 % of the range it has in the episode, closed from 25 %, in between as before.
    """
    low, high = opening.min(), opening.max()
    if high - low <= _STILL:
        return np.zeros(len(opening), int)
    share = (opening - low) / (high - low)
    sure = np.where(share >= _HIGH, 1, np.where(share <= _LOW, 0, -1))
    last = np.maximum.accumulate(np.where(sure >= 0, np.arange(len(sure)), -1))
    first = sure[np.flatnonzero(sure >= 0)[0]]
    return np.where(last >= 0, sure[last], first)


def farthest(positions: FloatArray) -> IntArray:
    """Return the frame that is farthest from the first, `(1,)`."""
    return np.array([np.linalg.norm(positions - positions[0], axis=1).argmax()])


def _changes(labels: np.ndarray) -> IntArray:
    return np.flatnonzero(labels[1:] != labels[:-1]) + 1
