"""How an episode moved: how long, how smoothly, how directly, and for how much of the time not at all."""

import numpy as np

from handrail.controllers.arrays import BoolArray, FloatArray, IntArray
from handrail.datasets.quality import metrics
from handrail.datasets.quality.metric import metric
from handrail.datasets.quality.scale import Scale
from handrail.datasets.reading.demonstration import Demonstration, DoesNotApply

WINDOW = 0.5  # [s]
FLOOR = 0.005  # net motion below which nothing moves: 5 mm where the motion is in metres
SHARE = 0.2  # of the 95th percentile
_TREMBLE = 0.01  # of the widest opening of a gripper in the datasets
_LOW, _HIGH = 0.25, 0.75  # of the gripper's range: where it counts as closed and as open again
_STILL = 1e-9  # a path shorter than this is no path, in the unit of the motion


@metric("s", "lower", title="episode length")
def length(episode: Demonstration, scale: Scale) -> float:
    """How long an episode took, which is the operator's time."""
    return episode.seconds


@metric("", "higher", "motion", "smoothness (SPARC)")
def sparc(episode: Demonstration, scale: Scale) -> float:
    """Spectral arc length of the speed: minimum jerk −1.4, more negative is less smooth."""
    return _known(metrics.sparc(episode.speed, episode.fps))


@metric("", "higher", "jerk", "smoothness (LDLJ)")
def ldlj(episode: Demonstration, scale: Scale) -> float:
    """Log dimensionless jerk of the speed: minimum jerk −5.3 (short ones up to −4.9); sensitive to noise."""
    return _known(metrics.ldlj(episode.speed, episode.fps))


@metric("", "higher", "motion")
def path_efficiency(episode: Demonstration, scale: Scale) -> float:
    """Straight-line over travelled distance, each phase on its own."""
    return straightness(episode.motion, phase_boundaries(episode, scale))


@metric("", "lower", "position", "idle, whole episode")
def idle_raw(episode: Demonstration, scale: Scale) -> float:
    """Share of time with hardly any net motion within 0.5 s."""
    return float(idle_windows(episode.motion, episode.fps).mean())


@metric("", "lower", "position", "idle, before the final hold")
def idle_pruned(episode: Demonstration, scale: Scale) -> float:
    """The same up to the last motion.

    Source: Handrail's own reference, after the pruning of pauses that imitation learning commonly does.
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

    By their first frame, `(N − w,)`. p95 is the 95th percentile of the same net motion in the episode;
    `positions` is `(N, d)`. `DoesNotApply` where the episode is not longer than a window.
    """
    width = max(1, round(WINDOW * fps))
    if len(positions) <= width:
        raise DoesNotApply(f"the episode is not longer than {WINDOW} s")
    net = np.linalg.norm(positions[width:] - positions[:-width], axis=1)
    return net < max(FLOOR, SHARE * float(np.percentile(net, 95)))


def straightness(positions: FloatArray, boundaries: IntArray) -> float:
    """Return Σ_p ‖x(end_p) − x(start_p)‖ / Σ_p ∫_p ‖dx‖ over phases p: 1 is straight, 0 goes nowhere.

    Source: the straightness index of movement analysis (Batschelet 1981), summed over phases so that
    there-and-back is not zero.

    Args:
        positions: `(N, d)`, any unit.
        boundaries: Frames at which a phase ends and the next begins, `(P,)`, rising.
    """
    ends = np.unique(np.concatenate(([0], boundaries, [len(positions) - 1])))
    travelled = metrics.path_length(positions)
    if travelled <= _STILL:
        raise DoesNotApply("nothing moves")
    return metrics.path_length(positions[ends]) / travelled


def phase_boundaries(episode: Demonstration, scale: Scale) -> IntArray:
    """Return the frames at which a phase ends and the next begins, `(P,)`.

    Where the recorded phase changes; without one, where a gripper opens or closes; without either or where
    none ever does, at the frame that is farthest from the start, so that there-and-back has two phases.
    """
    try:
        if episode.has("phase"):
            states = [episode.column("phase").reshape(episode.count, -1)[:, 0]]
        else:
            states = [gripper_state(each, scale.widest_opening) for each in episode.grippers.T]
        found = np.unique(np.concatenate([np.flatnonzero(each[1:] != each[:-1]) + 1 for each in states]))
    except DoesNotApply:
        found = np.empty(0, int)
    return found if found.size else farthest(episode.motion)


def gripper_state(opening: FloatArray, widest: float = 0.0) -> IntArray:
    """Return 1 where the gripper is open and 0 where closed, `(N,)`.

    Open from 75 % of the range it has in the episode, closed from 25 %, in between as before. One that only
    trembles, by 0.005 or 1 % of the widest opening of any, does neither.
    """
    low, high = opening.min(), opening.max()
    if high - low <= max(FLOOR, _TREMBLE * max(widest, np.abs(opening).max())):
        return np.zeros(len(opening), int)
    share = (opening - low) / (high - low)
    sure = np.where(share >= _HIGH, 1, np.where(share <= _LOW, 0, -1))
    last = np.maximum.accumulate(np.where(sure >= 0, np.arange(len(sure)), -1))
    first = sure[np.flatnonzero(sure >= 0)[0]]
    return np.where(last >= 0, sure[last], first)


def farthest(positions: FloatArray) -> IntArray:
    """Return the frame that is farthest from the first, `(1,)`."""
    return np.array([np.linalg.norm(positions - positions[0], axis=1).argmax()])
