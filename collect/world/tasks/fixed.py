"""A task of an experiment: it always begins alike, and a function is the judge."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from handrail.collect.world.tasks.task import Start, TaskState, Verdict
from handrail.controllers.arrays import FloatArray
from handrail.controllers.robot.model import RobotModel


@dataclass(frozen=True)
class FixedTask:
    """A task without anything random.

    Attributes:
        begin: how every episode begins.
        judge: says how it stands.
        horizon: time limit [s].
    """

    begin: Start
    judge: Callable[[TaskState], Verdict]
    horizon: float
    description: str = ""
    state_names: tuple[str, ...] = ()

    def sample(self, model: RobotModel, rng: np.random.Generator) -> Start:
        """Return the beginning."""
        return self.begin

    def features(self, state: TaskState) -> FloatArray:
        """Return no features, (0,)."""
        return np.zeros(0)

    def outcome(self, state: TaskState) -> Verdict:
        """Return what the judge says."""
        return self.judge(state)
