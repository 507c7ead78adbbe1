"""Every quality metric: what it is called, its unit, what it means, and how it is measured.

These numbers describe a dataset; they do not rank it. In a 2026 study the best defect detector gave the worst
policy, and five of seven metrics exploited the length of the episodes: look at them beside the outcome.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from handrail.controllers.arrays import FloatArray
from handrail.datasets.quality import consistency, effort, idle, path, safety, tracking
from handrail.datasets.quality.demonstration import Demonstration
from handrail.datasets.quality.information import information
from handrail.datasets.quality.metrics import ldlj, sparc
from handrail.datasets.quality.missing import DoesNotApply
from handrail.datasets.quality.neighbours import cloud, frames_of, mean_of_each
from handrail.datasets.quality.pool import Pool
from handrail.datasets.quality.units import Needs

Group = Sequence[Demonstration]
OfEpisode = Callable[[Demonstration, Pool], float]
OfGroup = Callable[[Group, Pool, np.random.Generator], FloatArray]


@dataclass(frozen=True)
class Metric:
    """A measure of quality.

    Attributes:
        name: Its name in JSON and CSV.
        title: What people call it.
        unit: Of its values; "" for a pure number.
        good: "higher" or "lower" where everything else being equal that is better; "" where it is not so.
        meaning: One sentence.
        measure: Its value for one episode, or None.
        measure_group: Its values for all episodes of a group, for what needs the others; or None. Such values
            depend on how many episodes there are and, through the neighbours they share, on each other.
        needs: What its unit hangs on, see `units.why_not`; "" where it has a unit of its own.
    """

    name: str
    title: str
    unit: str
    good: str
    meaning: str
    measure: OfEpisode | None = None
    measure_group: OfGroup | None = None
    needs: Needs = ""

    @property
    def of_group(self) -> bool:
        """Whether an episode's value depends on the other episodes of its group."""
        return self.measure_group is not None


def _speed(episode: Demonstration) -> FloatArray:
    return np.linalg.norm(np.diff(episode.motion, axis=0), axis=1) * episode.fps


def _known(value: float) -> float:
    if not np.isfinite(value):
        raise DoesNotApply("nothing moves, or the episode is too short")
    return value


def _vector(episode: Demonstration, part: str) -> FloatArray:
    return episode.numbers(part)[:, 0]


def _switches(episode: Demonstration, pool: Pool) -> float:
    mode = episode.column("mode") if episode.has("mode") else None
    return effort.mode_switches(mode, episode.owned if episode.has("owned") else None)


def _action_variance(group: Group, pool: Pool, rng: np.random.Generator) -> FloatArray:
    frames = frames_of(group, pool.frames)
    states = cloud(group, frames, lambda episode: pool.observations(episode.observation))
    actions = cloud(group, frames, lambda episode: pool.actions(episode.relative_action))
    values = consistency.action_variance(states.points, actions.points, states.owner)
    return mean_of_each(values, states.owner, len(group))


def _state_coverage(group: Group, pool: Pool, rng: np.random.Generator) -> FloatArray:
    states = cloud(
        group, frames_of(group, pool.frames), lambda episode: pool.configurations(episode.configuration)
    )
    return mean_of_each(consistency.state_coverage(states.points), states.owner, len(group))


def _information(group: Group, pool: Pool, rng: np.random.Generator) -> FloatArray:
    frames = frames_of(group, pool.frames)
    states = cloud(group, frames, lambda episode: pool.observations(episode.observation))
    actions = cloud(group, frames, lambda episode: pool.action_components(episode.relative_action))
    return mean_of_each(information(states.points, actions.points, rng), states.owner, len(group))


METRICS = (
    Metric(
        "length",
        "episode length",
        "s",
        "lower",
        "how long an episode took, which is the operator's time",
        lambda episode, pool: episode.seconds,
    ),
    Metric(
        "sparc",
        "smoothness (SPARC)",
        "",
        "higher",
        "spectral arc length of the speed: minimum jerk −1.4, more negative is less smooth",
        lambda episode, pool: _known(sparc(_speed(episode), episode.fps)),
        needs="motion",
    ),
    Metric(
        "ldlj",
        "smoothness (LDLJ)",
        "",
        "higher",
        "log dimensionless jerk of the speed: minimum jerk −5.2; very sensitive to noise",
        lambda episode, pool: _known(ldlj(_speed(episode), episode.fps)),
        needs="motion",
    ),
    Metric(
        "path_efficiency",
        "path efficiency",
        "",
        "higher",
        "straight-line over travelled distance, each phase on its own",
        lambda episode, pool: path.measure(episode),
        needs="motion",
    ),
    Metric(
        "idle_raw",
        "idle, whole episode",
        "",
        "lower",
        "share of time with hardly any net motion within 0.5 s",
        lambda episode, pool: idle.idle_share(episode.motion, episode.fps, pruned=False),
        needs="position",
    ),
    Metric(
        "idle_pruned",
        "idle, before the final hold",
        "",
        "lower",
        "the same up to the last motion",
        lambda episode, pool: idle.idle_share(episode.motion, episode.fps, pruned=True),
        needs="position",
    ),
    Metric(
        "action_variance",
        "action variance",
        "σ²",
        "",
        "spread of actions that other episodes took in like states; falls with more episodes, and is not"
        " monotone in quality",
        measure_group=_action_variance,
        needs="pool",
    ),
    Metric(
        "state_coverage",
        "state coverage",
        "nat",
        "",
        "entropy of the configurations: more is more varied, too little and too much are both bad; for groups"
        " of the same size",
        measure_group=_state_coverage,
        needs="pool",
    ),
    Metric(
        "information",
        "mutual information",
        "nat",
        "higher",
        "what the state says about the action (DemInf): varied and predictable at once",
        measure_group=_information,
        needs="pool",
    ),
    Metric(
        "tracking_error",
        "tracking error",
        "unit of the action",
        "lower",
        "distance of the next state from what was commanded",
        lambda episode, pool: tracking.tracking_error(episode.commanded, episode.reached),
        needs="action",
    ),
    Metric(
        "saturation",
        "saturation",
        "",
        "lower",
        "share of time in which an entry of the action stays at the end of its range",
        lambda episode, pool: tracking.saturation(episode.matrix("action"), *pool.action_range),
        needs="pool",
    ),
    Metric(
        "variation_ratio",
        "action total-variation ratio",
        "",
        "",
        "total variation of the commands over that of the motion; above 1 the robot smoothed them",
        lambda episode, pool: tracking.variation_ratio(episode.commanded, episode.reached),
        needs="action",
    ),
    Metric(
        "smallest_distance",
        "smallest distance",
        "m",
        "higher",
        "smallest signed distance to a collision",
        lambda episode, pool: safety.smallest_distance(_vector(episode, "distance")),
    ),
    Metric(
        "contacts",
        "contacts",
        "",
        "lower",
        "unwanted contacts that began",
        lambda episode, pool: safety.contacts_begun(_vector(episode, "contacts")),
    ),
    Metric(
        "impulse",
        "contact impulse",
        "N s",
        "lower",
        "impulse of all unwanted contacts",
        lambda episode, pool: safety.impulse(_vector(episode, "impulse")),
    ),
    Metric(
        "time_within_margin",
        "time within the margin",
        "s",
        "lower",
        "for how long something was nearer than the margin",
        lambda episode, pool: safety.time_within(_vector(episode, "distance"), pool.margin, episode.fps),
    ),
    Metric(
        "slack_used",
        "slack used",
        "unit of the limit",
        "lower",
        "how far a soft limit was given up at most",
        lambda episode, pool: safety.slack_used(_vector(episode, "slack")),
        needs="controller",
    ),
    Metric(
        "input_effort",
        "input effort",
        "s",
        "lower",
        "seconds of full deflection, input axes added up",
        lambda episode, pool: effort.input_effort(episode.inputs, pool.input_scale, episode.fps),
        needs="pool",
    ),
    Metric(
        "input_reversals",
        "input reversals",
        "",
        "lower",
        "how often an input axis changed its sign",
        lambda episode, pool: effort.input_reversals(episode.inputs, pool.input_scale),
        needs="pool",
    ),
    Metric(
        "mode_switches",
        "mode switches",
        "",
        "lower",
        "how often the mode, or the set of axes that the operator owned, changed",
        _switches,
    ),
    Metric(
        "active_axes",
        "active input axes",
        "",
        "lower",
        "mean number of input axes in use at a time",
        lambda episode, pool: effort.active_axes(episode.inputs, pool.input_scale),
        needs="pool",
    ),
)
