"""How far a rollout came, and how it ended, for those that fail."""

from collections import deque

import numpy as np

from handrail.collect.envs.env import HandrailEnv
from handrail.collect.session.outcome import Outcome
from handrail.collect.tasks.task import Staged
from handrail.controllers.arrays import FloatArray
from handrail.datasets.recording.frames import Frame

_LATELY = 5.0  # [s]
_STILL = 0.05  # extent of the tool's way in that time, at the scale of the robot's world [m]


class RolloutProgress:
    """Watches a rollout: the furthest stage of the task that it came to, and whether it stood still."""

    def begin(self, env: HandrailEnv, seed: int) -> None:
        """Take note that an episode begins."""
        self._env = env
        self._furthest, self._stage = -1, -1
        self._tools: deque[FloatArray] = deque(maxlen=max(2, round(_LATELY * env.fps)))

    def see(self, frame: Frame) -> None:
        """Look at the truth of this moment."""
        state, task = self._env.task_state(), self._env.task
        self._tools.append(state.tool.position)
        if isinstance(task, Staged):
            self._stage = task.stages.index(task.stage(state))
            self._furthest = max(self._furthest, self._stage)

    def failed(self, outcome: Outcome) -> dict[str, str]:
        """Return of a failure the furthest `stage`, if the task has stages, and how it `ended`.

        `dropped`: what it had in hand; `stalled`: the tool stayed within 5 cm for the last 5 s; `moving`.
        """
        task = self._env.task
        named = {"stage": task.stages[self._furthest]} if isinstance(task, Staged) else {}
        if outcome.failure_reason == "dropped" or self._fell_back:
            return named | {"ended": "dropped"}
        extent = float(np.linalg.norm(np.ptp(np.array(self._tools), axis=0)))
        still = extent < _STILL * self._env.model.description.world.scale
        return named | {"ended": "stalled" if still else "moving"}

    @property
    def _fell_back(self) -> bool:
        """Whether what had been lifted is in the hand no more."""
        task = self._env.task
        if not isinstance(task, Staged) or "carry" not in task.stages:
            return False
        return self._stage < task.stages.index("carry") <= self._furthest
