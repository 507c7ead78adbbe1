"""A trained policy, as an operator."""

from bisect import bisect_left
from dataclasses import replace
from operator import itemgetter

import numpy as np

from handrail.collect.operators.operator import View
from handrail.collect.world.env import HandrailEnv
from handrail.controllers.arrays import FloatArray
from handrail.controllers.interface.channels import Channels
from handrail.controllers.interface.intent import Intent
from handrail.policies.imitation.evaluation.conditions import Checkpoint, mode_action
from handrail.policies.imitation.interface.scene_memory import SceneMemory
from handrail.policies.imitation.interface.trained import TrainedPolicy


class RecordedColumns:
    """Reads and writes what was recorded, in place of a `PolicyInterface`: an action is a mode's channels.

    Args:
        checkpoint: of a policy that does; of mode `direct`, or none, an action is joint velocities.
    """

    def __init__(self, checkpoint: Checkpoint) -> None:
        self._action, self._joined = mode_action(checkpoint.meta), checkpoint.joined
        self.action_names = self._action.names

    def observe(self, state: FloatArray, environment: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the observation."""
        return (np.append(state, environment), environment[:0]) if self._joined else (state, environment)

    def decode(self, action: FloatArray, state: FloatArray) -> Intent:
        """Return the intent on the mode's channels."""
        return self._action.intent(action, 0.0)


class PolicyOperator:
    """Lets a policy steer; an operator.

    An action of another size, or one that is not finite, becomes an intent that no controller accepts: the
    robot brakes. Actions planned for moments at which nobody asked are left out; while the robot's clock
    stands still, as where nobody hears it, the policy does, too.

    Args:
        policy: whoever was trained.
        checkpoint: of it; its mode is that of the intents.
        env: where it steers.
        period: from one of its actions to the next [s]; 0 where it is asked at each of them.

    Attributes:
        malformed: unusable actions of this episode so far.
        doubt: 0: it does not say how unsure it is.
    """

    doubt = 0.0

    def __init__(
        self, policy: TrainedPolicy, checkpoint: Checkpoint, env: HandrailEnv, period: float = 0.0
    ) -> None:
        meta, size = checkpoint.meta, Channels.of(env.model.description).size
        self._policy, self._mode, self._task = policy, meta.mode, meta.task or env.task.description
        self._interface = meta.interface or RecordedColumns(checkpoint)
        self._unusable = Intent(np.full(size, np.nan), np.ones(size, bool))
        self._period = period
        self.malformed = 0
        if policy.encoder:
            policy.encoder.reads.check_robot(env.model)

    def reset(self, view: View, rng: np.random.Generator) -> None:
        """Begin an episode."""
        if self._policy.encoder:
            self._memories = [(-np.inf, SceneMemory(self._policy.encoder.reads))]
        self.malformed = 0
        self.replan()

    def replan(self) -> None:
        """Forget what is planned; what was seen is remembered."""
        self._policy.reset()
        self._asked, self._state = np.inf, np.zeros(0)  # nothing was answered yet

    def act(self, view: View) -> Intent:
        """Return the intent now."""
        if self._period and view.state.time == self._asked:
            return self._said
        seen = view.observation
        state, around, pictures = seen["agent_pos"], seen["environment_state"], seen.get("pixels", {})
        if encoder := self._policy.encoder:
            numbers = encoder.read({name: each[None] for name, each in pictures.items()})
            said = encoder.said(numbers, state[None])
            memory = self._before(view.state.time)
            around = memory.take(said, 0)
            self._memories.append((view.state.time, memory))
        if self._period and view.state.time > self._asked + 1.5 * self._period:
            self._policy.skip(round((view.state.time - self._asked) / self._period) - 1)
        self._asked, self._state = view.state.time, state
        observed = self._interface.observe(state, around)
        action = np.asarray(self._policy.act(*observed, pictures, self._task))
        self.malformed += not self._fits(action)
        self._said = replace(self._read(action, state), mode=self._mode, time=view.state.time)
        return self._said

    def _before(self, time: float) -> SceneMemory:
        """Return a memory of what was seen; after an undo, of what was seen before a time [s]."""
        known = self._memories
        if time <= known[-1][0]:
            del known[bisect_left(known, time, key=itemgetter(0)) :]
        return known[-1][1].copy()

    def chunk(self) -> list[Intent]:
        """Return what is planned for the periods after the last intent, as meant where the robot was then."""
        if not len(self._state):
            return []
        later = [self._read(row, self._state) for row in self._policy.planned()]
        return [
            replace(each, mode=self._mode, time=float(self._asked + self._period * period))
            for period, each in enumerate(later, start=1)
        ]

    def _read(self, action: FloatArray, state: FloatArray) -> Intent:
        """Return what an action means; an intent that brakes if it is not finite, or of the wrong size."""
        return self._interface.decode(action, state) if self._fits(action) else self._unusable

    def _fits(self, action: FloatArray) -> bool:
        return action.shape == (len(self._interface.action_names),) and bool(np.all(np.isfinite(action)))
