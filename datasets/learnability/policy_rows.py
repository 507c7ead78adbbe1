"""What a policy reads and writes in the frames of an episode.

Nothing here knows a policy: whoever trains some says how they see, by a `PolicyView`; without one a dataset
is taken as it is.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from handrail.controllers.arrays import FloatArray
from handrail.datasets.demonstrations.demonstration import Demonstration, DoesNotApply
from handrail.datasets.demonstrations.naming import is_velocity
from handrail.datasets.learnability.candidates import BASE, BASE_POSE


@dataclass(frozen=True)
class Actions:
    """What a policy writes in one action space.

    Attributes:
        names: Of the entries, `(a,)`.
        values: `(N, a)`.
    """

    names: tuple[str, ...]
    values: FloatArray


@dataclass(frozen=True)
class PolicyRows:
    """What a policy reads, and what it should write then.

    Attributes:
        seen: `(N, s)`.
        actions: By action space, the usual one first.
        shown: Which columns of `seen` say what others hide, by the names of `candidates`.
    """

    seen: FloatArray
    actions: Mapping[str, Actions]
    shown: Mapping[str, tuple[int, ...]] = field(default_factory=dict)


PolicyView = Callable[[Demonstration], PolicyRows]


def recorded_view(episode: Demonstration) -> PolicyRows:
    """Return the numbers under `observation.` but velocities, and the action, its positions from the robot.

    The robot's own velocities are left out: the next action is nearly what the robot does already.

    Raises:
        DoesNotApply: There is no observation or no action with numbers.
    """
    values = episode.relative_action
    names = episode.entries("action") or tuple(f"action.{place}" for place in range(values.shape[1]))
    kept = [place for place, name in enumerate(episode.observation_names) if not is_velocity(name)]
    if not kept:
        raise DoesNotApply("the observation holds nothing but velocities")
    seen = [episode.observation_names[place] for place in kept]
    base = tuple(seen.index(name) for name in BASE if name in seen)
    shown = {BASE_POSE: base} if len(base) == len(BASE) else {}
    return PolicyRows(episode.observation[:, kept], {"action": Actions(names, values)}, shown)
