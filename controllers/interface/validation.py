"""The checks that every controller makes before it listens to an intent."""

import math
from dataclasses import dataclass
from typing import NamedTuple

from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.command import Status
from handrail.controllers.interface.controller import State
from handrail.controllers.interface.intent import Intent

_LEAD = 0.05  # by which an intent's stamp may be ahead of the state's clock: one control period [s]
_TICK = 1e-4  # by which the state's clock advances from update to update at least [s]


class InputHistory(NamedTuple):
    """When the inputs of the updates so far came."""

    time: float = -math.inf  # of the last state [s]
    stamp: float = -math.inf  # of the newest intent [s]
    age: float = 0.0  # time since that came first [s]
    jumped: bool = False  # whether the clock jumped back since

    def at(self, time: float) -> "InputHistory":
        """Return the history at a state's time [s], which may be no number."""
        if not math.isfinite(time):
            return self
        passed = time - self.time
        return InputHistory(time, self.stamp, self.age + max(passed, 0.0), self.jumped or passed < 0.0)

    def with_stamp(self, stamp: float) -> "InputHistory":
        """Return the history with an intent's stamp [s], if that is a new one."""
        if stamp > self.stamp or (self.jumped and stamp < self.stamp):
            return InputHistory(self.time, stamp)
        return self


@dataclass(frozen=True)
class InputValidator:
    """Says whether an update's inputs may move the robot.

    An intent is new if its stamp is later than all before. With t the state's time, t_s the stamp and t_a the
    time at which it came first, its age is `max(t - t_s, t - t_a)`: an operator whose clock is ahead grows
    stale like any other. The state's clock must advance; one that stands still or jumps back is a fault, for
    then nobody knows how old anything is. After it jumped back a stamp that differs from the last one is new
    too: those of before may lie ahead now; what was there before the jump grows older all the same.
    """

    channels: Channels  # of the robot
    timeout: float  # age from which an intent is stale [s]

    def check(
        self, state: State, intent: Intent, scene_makes_sense: bool, before: InputHistory
    ) -> tuple[Status, InputHistory]:
        """Return `ok`, or why the robot must brake; and the history with this update's inputs."""
        now = before.at(state.time)
        advances = math.isfinite(state.time) and state.time - before.time > _TICK
        if not (advances and state.is_of(len(self.channels.joints))):
            return Status.INVALID_STATE, now
        if not scene_makes_sense:
            return Status.INVALID_SCENE, now
        if not self._is_intent(state, intent):
            return Status.INVALID_INTENT, now
        now = now.with_stamp(intent.time)
        stale = max(state.time - intent.time, now.age) > self.timeout
        return Status.STALE_INTENT if stale else Status.OK, now

    def _is_intent(self, state: State, intent: Intent) -> bool:
        size = self.channels.size
        if intent.values.shape != (size,) or intent.mask.shape != (size,):
            return False
        if len(intent.grippers) not in (1, len(self.channels.hands)):
            return False
        return intent.is_finite and intent.frames.are_known and intent.newest <= state.time + _LEAD
