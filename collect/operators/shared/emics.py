"""EMICS and HierEMICS: the level of autonomy switches, by the person or by how little way the robot makes.

```
              the person moves something, having moved nothing
policy drives ─────────────────────────────────────────────────▶ person drives
              ◀────────────────────────────────────────────────▶
              the first criterion that says who shall, at most once in a while
```
After Chiou, Hawes, Stolkin, *Mixed-Initiative variable autonomy for remotely operated mobile robots* (arXiv
1911.04848), and Panagopoulos et al., *A Hierarchical Variable Autonomy Mixed-Initiative Framework for
Human-Robot Teaming in Mobile Robotics* (arXiv 2211.14095), as their abstracts and their published program
(uob-erl/fuzzy_mi_controller) have them. Theirs is a mobile base with a path planner as the expert; here the
expert is the policy, on whatever channels it owns. docs/takeover.md says what else differs.
"""

from collections.abc import Sequence

import numpy as np

from handrail.collect.operators.shared.arbiter import Groups, Lately, Shares, Wishes
from handrail.collect.operators.shared.settings import ArbiterSettings
from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.sources import PERSON, POLICY

_SLOW = 0.02  # ε: a policy that wishes for less has no goal-directed motion [m/s, rad/s]
_FAST = 3.0  # a policy that wishes for more wishes for this [m/s, rad/s]
_LONGEST = 0.1  # that a moment counts in a mean, after a pause too [s]
_GONE = 1.0  # a policy that plans anew has no answer for a moment; after this it is gone [s]
_STEADY = 0.5  # length of the mean command over the mean length, from which a person has a purpose


class RunningMean:
    """⟨x⟩ over a window τ that forgets: `⟨x⟩ ← ⟨x⟩ + (1 - exp(-Δt / τ)) (x - ⟨x⟩)`.

    Args:
        window: τ [s].
    """

    def __init__(self, window: float) -> None:
        self._window = window
        self.reset()

    def reset(self) -> None:
        """Forget all."""
        self._mean, self._time = np.zeros(1), -np.inf

    def add(self, value: FloatArray, time: float) -> FloatArray:
        """Return the mean with a value, (k,), at a time [s]; what is no number is left out."""
        passed = np.clip(time - self._time, 0.0, _LONGEST)
        self._time = time
        known = np.where(np.isfinite(value), value, self._mean)
        self._mean = self._mean + (1.0 - np.exp(-passed / self._window)) * (known - self._mean)
        return self._mean


class Performance:
    """A driver loses the robot by making too little of the way that the policy would make.

    With the policy's wish û on its channels and what these do, c, the error of goal-directed motion is
    `e = ‖û‖ - û·c / max(‖û‖, ε)`, from 0 to 2 ‖û‖, and `E = ⟨e⟩ / max(⟨‖û‖⟩, ε)`: 0 as fast as the policy
    toward its goal, 1 no way at all, more: away from it. Metres and radians count alike.

    Args:
        settings: the threshold of E, the window of its means.
    """

    def __init__(self, settings: ArbiterSettings) -> None:
        self._threshold, self._mean, self._level = settings.error, RunningMean(settings.window), ""

    def reset(self) -> None:
        """Begin an episode."""
        self._mean.reset()

    def wants(self, level: str, wishes: Wishes) -> str | None:
        """Return the other one, where the error is too large; who drives anew is judged anew."""
        if level != self._level:
            self._mean.reset()
            self._level = level
        if wishes.policy is None:
            return None
        mask = wishes.policy.mask
        wish, done = wishes.policy.values[mask], wishes.realised[mask]
        wish = wish / max(float(np.linalg.norm(wish)) / _FAST, 1.0)
        speed = float(np.linalg.norm(wish))
        made = np.clip(wish @ done / max(speed, _SLOW), -speed, speed)
        missing, possible = self._mean.add(np.array([speed - made, speed]), wishes.time)
        other = POLICY if level == PERSON else PERSON
        return other if missing > self._threshold * max(possible, _SLOW) else None


class Availability:
    """A person who has moved nothing for long is not there: the policy drives.

    Args:
        groups: of the robot's channels.
        settings: how long.
    """

    def __init__(self, groups: Groups, settings: ArbiterSettings) -> None:
        self._groups, self._away = groups, settings.away
        self.reset()

    def reset(self) -> None:
        """Begin an episode: whoever began it is there."""
        self._seen: float | None = None

    def wants(self, level: str, wishes: Wishes) -> str | None:
        """Return the policy, unless the person is there."""
        if self._seen is None or self._groups.moved(wishes.person).any():
            self._seen = wishes.time
        return POLICY if abs(wishes.time - self._seen) > self._away else None


class Purpose:
    """A person who steers one way knows what for: they drive, `‖⟨û_h⟩‖ > ⟨‖û_h‖⟩ / 2`.

    To and fro, the mean command is short, and this criterion does not mind.

    Args:
        groups: of the robot's channels.
        settings: the window of the means.
    """

    def __init__(self, groups: Groups, settings: ArbiterSettings) -> None:
        self._groups, self._mean = groups, RunningMean(settings.window)

    def reset(self) -> None:
        """Begin an episode."""
        self._mean.reset()

    def wants(self, level: str, wishes: Wishes) -> str | None:
        """Return the person, while they steer and with a purpose."""
        moved = self._groups.moved(wishes.person)
        asked = np.where(moved, wishes.person.values, 0.0)
        length, *mean = self._mean.add(np.array([np.linalg.norm(asked), *asked]), wishes.time)
        steady = np.linalg.norm(mean) > _STEADY * length
        return PERSON if moved.any() and steady else None


Criterion = Performance | Availability | Purpose
"""Says who shall drive, from what it sees."""


class LevelSwitcher:
    """One of both drives the whole robot: the policy at first.

    The person takes it by moving something, having moved nothing; so they take it back from the switcher by
    letting go and pushing again. Otherwise the first criterion that says who shall drive is followed, at
    most once in `dwell`. Where the policy has had no usable answer for 1 s, the person has it. While it is
    theirs and they move nothing, nobody drives.

    Args:
        groups: of the robot's channels.
        settings: the dwell time, and how long something counts as moved.
        criteria: the most critical first.
    """

    def __init__(self, groups: Groups, settings: ArbiterSettings, criteria: Sequence[Criterion]) -> None:
        self._groups, self._lately = groups, Lately(groups, settings)
        self._dwell, self._criteria = settings.dwell, criteria
        self.reset()

    def reset(self) -> None:
        """Begin an episode."""
        for part in (self._lately, *self._criteria):
            part.reset()
        self._level, self._moving = POLICY, False
        self._since: float | None = None
        self._asked = self._usable = -np.inf  # when both wishes came last, and the policy had an answer [s]

    def shares(self, wishes: Wishes) -> Shares:
        """Return 1 for whoever drives, 0 for the other."""
        self._decide(wishes)
        person = self._level == PERSON and bool(self._lately.owned(wishes).any())
        shares = (float(person), float(self._level == POLICY))
        return Shares(*(np.full(self._groups.channels.size, share) for share in shares))

    def _decide(self, wishes: Wishes) -> None:
        """Switch the level, if it is time to."""
        since = wishes.time if self._since is None else self._since
        wanted = [criterion.wants(self._level, wishes) for criterion in self._criteria]
        may = abs(wishes.time - since) >= self._dwell
        level = next(filter(None, wanted), self._level) if may else self._level
        before, self._moving = self._moving, bool(self._groups.moved(wishes.person).any())
        if wishes.policy is not None or wishes.time - self._asked > _GONE / 2:  # after a pause it plans anew
            self._usable = wishes.time
        self._asked = wishes.time
        if abs(wishes.time - self._usable) > _GONE or (self._moving and not before):
            level = PERSON
        self._since = since if level == self._level else wishes.time
        self._level = level


def emics(groups: Groups, settings: ArbiterSettings) -> LevelSwitcher:
    """Return EMICS: the error of goal-directed motion alone."""
    return LevelSwitcher(groups, settings, (Performance(settings),))


def hier_emics(groups: Groups, settings: ArbiterSettings) -> LevelSwitcher:
    """Return HierEMICS: whether the person is there, then whether they know what for, then the error."""
    criteria = (Availability(groups, settings), Purpose(groups, settings), Performance(settings))
    return LevelSwitcher(groups, settings, criteria)
