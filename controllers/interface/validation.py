"""The checks that every controller makes before it listens to an intent."""

import math

from handrail.controllers.collision.surroundings import Surroundings
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Status
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent

_LEAD = 0.05  # by which an intent's stamp may be ahead of the state's clock: one control period [s]
_TICK = 1e-4  # by which the state's clock advances from update to update at least [s]


class InputValidator:
    """Says whether an update's inputs may move the robot; remembers when they came.

    An intent is new if its stamp is later than all before. With t the state's time, t_s the stamp and t_a the
    time at which it came first, its age is `max(t - t_s, t - t_a)`: an operator whose clock is ahead grows
    stale like any other. The state's clock must advance; one that stands still or jumps back is a fault, for
    then nobody knows how old anything is. After it jumped back a stamp that differs from the last one is new
    too: those of before may lie ahead now; what was there before the jump grows older all the same.

    Args:
        channels: of the robot.
        timeout: age from which an intent is stale [s].
    """

    def __init__(self, channels: Channels, timeout: float) -> None:
        self._channels = channels
        self._timeout = timeout
        self.reset()

    def reset(self) -> None:
        """Forget what came."""
        self._time = self._stamp = -math.inf
        self._age, self._jumped = 0.0, False

    def check(self, state: State, intent: Intent, surroundings: Surroundings) -> Status:
        """Return `ok`, or why the robot must brake."""
        if not (self._advances(state.time) and state.is_of(len(self._channels.joints))):
            return Status.INVALID_STATE
        if not surroundings.make_sense:
            return Status.INVALID_SCENE
        return self._check_intent(state, intent)

    def _check_intent(self, state: State, intent: Intent) -> Status:
        size = self._channels.size
        if intent.values.shape != (size,) or intent.mask.shape != (size,):
            return Status.INVALID_INTENT
        if not (intent.is_finite and intent.frames.are_known) or intent.time > state.time + _LEAD:
            return Status.INVALID_INTENT
        if intent.time > self._stamp or (self._jumped and intent.time < self._stamp):
            self._stamp, self._age, self._jumped = intent.time, 0.0, False
        return Status.STALE_INTENT if max(state.time - intent.time, self._age) > self._timeout else Status.OK

    def _advances(self, time: float) -> bool:
        """Take the state's time [s]; return whether it is later than the one before."""
        if not math.isfinite(time):
            return False
        passed, self._time = time - self._time, time
        self._jumped |= passed < 0.0
        self._age += max(passed, 0.0)
        return passed > _TICK
