"""Pushes: somebody bumps into the base or the hand, now and then."""

from dataclasses import dataclass

import numpy as np

from handrail.collect.world.envs.env import HandrailEnv
from handrail.controllers.arrays import FloatArray, frozen

_STREAM = 2  # of the episode's seed; 1 is the operator's
_FIRST, _PAUSE = (0.5, 2.0), (2.5, 5.0)  # when the first comes, and from one to the next [s]
_DURATION = (0.15, 0.25)  # [s]
_BASE_EXCESS = 0.4  # force on the base over what its servos hold, a share of it
_HAND_HELD, _HAND_EXCESS = 0.30, 0.25  # force on the hand over the arm's largest torque [1/m]


@dataclass(frozen=True)
class Push:
    """A force that acts for a moment.

    Attributes:
        start: when it begins [s].
        end: when it ends [s].
        hand: whether it acts at the tool point, else on the base's centre.
        direction: in the world, (3,); horizontal on the base.
    """

    start: float
    end: float
    hand: bool
    direction: FloatArray

    def __post_init__(self) -> None:
        """Copy the array and make it read-only."""
        object.__setattr__(self, "direction", frozen(self.direction))


def sample_pushes(seed: int, horizon: float) -> tuple[Push, ...]:
    """Draw the pushes of an episode; its seed alone says when, where and which way.

    Args:
        seed: of the episode.
        horizon: its longest duration [s].
    """
    rng = np.random.default_rng([seed, _STREAM])
    pushes, start = [], rng.uniform(*_FIRST)
    while start < horizon:
        hand = bool(rng.random() < 0.5)
        direction = rng.normal(size=3)
        if not hand:
            direction[2] = 0.0
        direction /= np.linalg.norm(direction)
        pushes.append(Push(start, start + rng.uniform(*_DURATION), hand, direction))
        start += rng.uniform(*_PAUSE)
    return tuple(pushes)


class Pusher:
    """Pushes the robot at moments that the seed says; a disturbance.

    The servos hold velocities, so a push moves the robot only beyond what they hold: with size s the base is
    pushed with `(1 + 0.4 s)` times its servos' force, the hand with `(0.30 + 0.25 s)` N for each N m of the
    arm's largest torque.

    Measured on the Ridgeback with UR10, at rest at home, s = 1, over 40 seeds: a push moves the base by 1 to
    18 cm (median 7), the hand by 3 to 19 cm (median 5), depending on direction and duration.

    Args:
        size: s.
    """

    def __init__(self, size: float) -> None:
        self._size = size

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Draw the pushes of an episode."""
        self._simulation = env.simulation
        self._pushes = sample_pushes(seed, env.task.horizon)
        effort, base = env.model.description.limits.effort, len(env.model.description.base_joints)
        self._base = float(np.min(effort[: min(base, 2)], initial=np.inf)) * (1.0 + _BASE_EXCESS * self._size)
        self._hand = float(np.max(effort[base:])) * (_HAND_HELD + _HAND_EXCESS * self._size)
        self._movable = base > 0

    def act(self) -> None:
        """Set the forces of the control period that begins now."""
        now, forces = self._simulation.time, {True: np.zeros(3), False: np.zeros(3)}
        for push in self._pushes:
            if push.start <= now < push.end:
                forces[push.hand] += push.direction * self._strength(push)
        self._simulation.push(forces[False], forces[True])

    def _strength(self, push: Push) -> float:
        """Return how strong a push is [N]; a robot that stands fixed is pushed at its hand only."""
        return self._hand if push.hand else self._base if self._movable else 0.0
