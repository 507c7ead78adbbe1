"""A person and a policy steer one robot: an arbiter says who owns what, the MPC completes and keeps it safe.

```
person ─ intent ─┐
                 ├▶ arbiter ─ weights ─▶ intents of two sources ─▶ controller
policy ─ intent ─┘
```
A person's word on the episode (pause, e-stop, success) comes first: the policy moves only while they
supervise, with an input that is fresh.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from handrail.collect.operators.operator import EpisodeEvent, Operator, View
from handrail.collect.operators.shared.arbiter import Arbiter, Groups, Wishes
from handrail.collect.operators.shared.planning import Planner
from handrail.collect.operators.shared.settings import HANDBACK
from handrail.controllers.arrays import BoolArray, are_finite
from handrail.controllers.interface.channel_matrix import channel_matrix
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import DEAD_MAN_TIME, LONG_AGO, Intent
from handrail.controllers.interface.sources import PERSON, POLICY, Intents, IntentSource, Preview
from handrail.controllers.interface.usual_frames import in_usual_frames
from handrail.controllers.robot.model import RobotModel


class SharedOperator:
    """A person (or a script) and a policy as one operator.

    The policy plans anew when it gets something back. A gripper is the person's while they have something of
    its hand, or have changed it a moment ago, or the policy drives nothing; until they change it, it stays as
    it is. A change closes what is open and opens what is closed. Where nobody drives, the robot brakes.

    Args:
        person: who supervises.
        policy: who drives.
        arbiter: says how much each weighs.
        model: of the robot.
        shares: whether a teleop mode can be shared, by its name; in others the person drives alone.
    """

    def __init__(
        self,
        person: Operator,
        policy: Planner,
        arbiter: Arbiter,
        model: RobotModel,
        shares: Callable[[str], bool] = lambda mode: True,
    ) -> None:
        self._person, self._policy, self._arbiter = person, policy, arbiter
        self._model, self._shares = model, shares
        self._channels = Channels.of(model.description)
        self._groups = Groups(self._channels)
        self._hands = len(model.description.hands)

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin an episode."""
        self._person.reset(view, rng)
        self._policy.reset(view, rng.spawn(1)[0])  # what the person draws is as without a policy
        self._find(view)
        self._held = np.zeros(self._channels.size, dtype=bool)  # what the policy gave up, or shares
        self._waits = self._undone = False

    def act(self, view: View) -> Intent | EpisodeEvent:
        """Return both wishes as one intent, or what the person says of the episode."""
        asked = self._person.act(view)
        if isinstance(asked, EpisodeEvent):
            self._waits, self._undone = True, self._undone or asked is EpisodeEvent.UNDO
            return asked
        if self._undone:
            self._find(view)
            self._undone = False
        if self._waits:
            self._policy.replan()
            self._waits = False
        asked = asked.of_hands(self._hands)
        wanted = self._wanted(view)
        if not self._makes_sense(asked):
            return asked  # the controller brakes
        person = in_usual_frames(asked, self._model, view.state.q)
        if person is None or not self._shares(asked.mode):
            self._held[:] = True
            self._take_grippers(asked, self._held, view.state.time)
            return replace(asked, grippers=tuple(self._closed))
        return self._merged(person, *wanted, view)

    def _find(self, view: View) -> None:
        """Take the grippers as they are; nobody has taken anything yet."""
        self._arbiter.reset()
        self._changed = [-np.inf] * self._hands  # when the person changed each [s]
        self._closed = list(view.grippers or [0.0] * self._hands)  # how far each is asked to be closed
        self._level = tuple(self._closed)  # of each as the person's device says

    def _makes_sense(self, intent: Intent) -> bool:
        fits = intent.values.shape == (self._channels.size,)
        return fits and intent.is_finite and intent.frames.are_known

    def _wanted(self, view: View) -> tuple[Intent | None, Preview | None]:
        """Return what the policy wants, and what it has planned, if it plans ahead.

        None of an answer or a plan that no controller accepts, or of an old one.
        """
        now, later = self._policy.act(view).of_hands(self._hands), self._policy.chunk()
        plan = [now, *later]
        usable = all(self._makes_sense(each) and are_finite(each.values[now.mask]) for each in plan)
        is_old = view.state.time - now.time > DEAD_MAN_TIME
        wanted = in_usual_frames(now, self._model, view.state.q) if usable and not is_old else None
        if wanted is None or not later:
            return wanted, None
        plan[0] = wanted
        return wanted, Preview(
            np.array([each.values for each in plan]), np.array([each.time for each in plan])
        )

    def _merged(self, person: Intent, policy: Intent | None, ahead: Preview | None, view: View) -> Intent:
        """Return the sum of both, by the arbiter's weights."""
        time = view.state.time
        realised = channel_matrix(self._model, self._channels, view.state.q) @ view.state.v
        shares = self._arbiter.shares(Wishes(time, person, policy, realised, self._policy.doubt))
        owned, free = person.mask & (shares.person > 0.0), shares.policy > 0.0
        held = owned | ~free
        if np.any(self._held & ~held):  # handed back: what was planned before led from elsewhere
            self._policy.replan()
            policy, ahead = self._wanted(view)
        self._held = held
        drives = policy is not None and bool(np.any(policy.mask & free))
        mine = [own or not drives for own in self._take_grippers(person, owned, time)]
        sources = [IntentSource(PERSON, person, shares.person)]
        if policy is not None:
            wanted = zip(self._closed, policy.grippers, mine, strict=True)
            self._closed = [now if own else then for now, then, own in wanted]
            policy = replace(policy, mode=person.mode)
            sources.append(IntentSource(POLICY, policy, shares.policy, ahead))
        intents = Intents.of(sources, tuple(self._closed), person)
        fresh = min(intents.time, person.time) if intents.mask.any() else LONG_AGO
        return replace(intents, time=fresh, of_grippers=tuple(PERSON if own else POLICY for own in mine))

    def _take_grippers(self, person: Intent, owned: BoolArray, time: float) -> list[bool]:
        """Do what the person says of the grippers; return which are theirs. A script means what it says."""
        last, self._level = self._level, person.grippers
        has, device = self._groups.grippers(owned), bool(person.raw.device)
        for hand, (level, before) in enumerate(zip(person.grippers, last, strict=True)):
            if not device:
                self._closed[hand] = level if has[hand] else self._closed[hand]
            elif level != before:
                same = round(level) == round(self._closed[hand])
                self._closed[hand] = 1.0 - level if same else level
                self._changed[hand] = time
        return [own or abs(time - then) < HANDBACK for own, then in zip(has, self._changed, strict=True)]
